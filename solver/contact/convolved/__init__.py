"""Contact without shear on a surface without ends: no matrix, displacements by FFT."""
