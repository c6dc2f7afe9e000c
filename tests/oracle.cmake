# The tests that know the truth.
target_sources(test_oracle PRIVATE oracle.c oracle_edge.c oracle_shape.c truth_file.c)
target_sources(test_error_bound PRIVATE oracle.c oracle_edge.c oracle_shape.c random_fog.c)
target_sources(test_properties PRIVATE random_fog.c)
