// Compiled once per public header as C++11: the header compiles alone, and twice in a row.
#include NB_HEADER
#include NB_HEADER

typedef int translation_unit_is_not_empty;
