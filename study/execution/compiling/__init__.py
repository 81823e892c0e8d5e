"""What is compiled before a run begins: its kernels, by small tasks that call them."""
