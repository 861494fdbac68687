"""The studio: a page in which a mill turns, simulated by the engine in WebAssembly."""
