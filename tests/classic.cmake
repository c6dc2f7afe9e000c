# The tests of classic fog in OpenGL watch their context as the passes do; every test_pass_classic_NAME.c shares a mesh.
share_with(test_classic_gl pass_help.c projections.c)
share_with(test_pass_classic_* classic_help.c)
