#include "daemon/base/version/software_version.hpp"

#include "weft_build_stamp.hpp"

namespace weft::daemon {

std::string software_commit() {
  return WEFT_COMMIT;
}

std::string software_version() {
  return software_commit().empty() ? WEFT_VERSION : WEFT_VERSION "+g" WEFT_COMMIT;
}

}  // namespace weft::daemon
