"""Other people's ranging data: NIST, Monash and Plaza 2."""
