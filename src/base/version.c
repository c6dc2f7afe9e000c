#include <nebel/nebel.h>

#define TEXT(x) #x
#define NUMBER(x) TEXT(x)

const char *nebel_version(void)
{
    return NUMBER(NEBEL_VERSION_MAJOR) "." NUMBER(NEBEL_VERSION_MINOR) "." NUMBER(NEBEL_VERSION_PATCH);
}

const char *nebel_result_text(nebel_result result)
{
    switch (result) {
#define RESULT_TEXT(name, value, text)                                                                                 \
    case NEBEL_##name:                                                                                                 \
        return text;
        NEBEL_RESULTS(RESULT_TEXT)
#undef RESULT_TEXT
    }
    return "unknown result";
}
