# The tests that compare pictures of both renderers.
share_with(test_picture_* picture_help.c odd_state.c pass_help.c projections.c random_fog.c)
