"""Reads and writes model files: TOML in and out, refused with the line and the nearest valid name where it is wrong.

One table (`KEYS`) holds every key with its unit and what it may be; the JSON Schema, the reader and the writer all come
from it. A file describes one joint, or an arm: then what stands at the top holds for every joint, and
``[joints.NAME.plant]`` (or ``.controller``, ``.sensors``, ``.bus``, ``.trust``) overrides it key by key, while
``[[joints.NAME.physics]]`` adds terms to those at the top.
"""

from gsfdi.modelfile.keys import terms
from gsfdi.modelfile.reading import Models, load_models
from gsfdi.modelfile.writing import dump

__all__ = ["Models", "dump", "load_models", "terms"]
