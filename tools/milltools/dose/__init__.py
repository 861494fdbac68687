"""What the impacts of a run do to the powder: dose, stress energy, captured powder, reaction rates, temperatures."""
