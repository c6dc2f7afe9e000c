# The tests that know the truth.
target_sources(test_oracle PRIVATE oracle.c oracle_shape.c truth_file.c)
