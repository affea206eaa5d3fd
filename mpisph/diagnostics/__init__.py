"""What is looked at in every step: conserved sums, the cloud, signs of instability."""
