"""What a question is answered with: results as data, ranked and put into words."""
