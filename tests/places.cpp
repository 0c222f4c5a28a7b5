#include "places.hpp"

namespace fathom::test::places {

const char* const sources = FATHOM_SOURCE_DIR;
const char* const shared_data = FATHOM_SHARED_DATA;
#ifdef FATHOM_PROGRAM
const char* const program = FATHOM_PROGRAM;
const char* const failing_malloc = FATHOM_FAILING_MALLOC;
#else
const char* const program = "";
const char* const failing_malloc = "";
#endif
const char* const layer = FATHOM_LAYER;
#ifdef __SANITIZE_ADDRESS__
const bool sanitized = true;
#else
const bool sanitized = false;
#endif

} // namespace fathom::test::places
