"""The proof on concealed data: worlds that share no code with the simulator, sealed truths, scores."""
