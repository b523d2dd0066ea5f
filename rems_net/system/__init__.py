"""The operating system: files, standard input, interrupts."""
