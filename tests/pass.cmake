# Every test_pass_NAME.c draws through pass_help.h; views are judged by the same projections.
share_with(test_pass_* odd_state.c pass_help.c projections.c)
share_with(test_view_gl projections.c)
