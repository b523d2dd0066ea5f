"""Work of an agent beside its ticks: threads and processes of its own."""
