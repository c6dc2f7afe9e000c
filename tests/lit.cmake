# More of test_lit_truth under other seeds, so that it runs on several processors: two parts in `make test`, all four in
# `make test-all`.
if(NOT CMAKE_CROSSCOMPILING AND TEST test_lit_truth)
    foreach(part IN ITEMS 2 3 4)
        add_check(test_lit_truth_${part} nebel_test_core test_lit_truth ${part}000000)
    endforeach()
endif()
