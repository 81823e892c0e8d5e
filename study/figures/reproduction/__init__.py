"""The paper's Figures 5 to 11, and the choices that it leaves open."""
