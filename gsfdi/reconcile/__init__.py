"""Where simulation and recording differ, which physics was left out, and the fit once it is modelled."""
