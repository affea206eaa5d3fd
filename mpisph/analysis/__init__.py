"""What the debris and the experiment's clock are like, from stored runs."""
