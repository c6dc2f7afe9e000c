# The facts recorded of Direct3D 9.
target_sources(test_classic_d3d9 PRIVATE d3d9_facts.c)
