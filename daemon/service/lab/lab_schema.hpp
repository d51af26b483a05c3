#pragma once
// The SQL files of daemon/service/lab/schema, built in.

#include <span>
#include <string_view>

namespace weft::daemon::lab {

/// A file "0001_store.sql". Version 0 makes the roles and runs at each installation; the others run
/// once, in order.
struct Migration {
  int version = 0;
  std::string_view name;  ///< "0001_store"
  std::string_view sql;
};
/// By version, without gaps.
std::span<const Migration> migrations();

}  // namespace weft::daemon::lab
