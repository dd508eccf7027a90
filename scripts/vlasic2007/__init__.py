"""Table 1 and figure 7 of Vlasic 2007 on simulated recordings (`scripts/reproduce_vlasic2007`)."""
