#pragma once
// The tables of weftd.sqlite. For .cpp files of daemon/service/run_store.

#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon::runs {

/// Makes what is not there; a file from before there was a column gets it.
Status make_tables(sqlite::Database& database);

}  // namespace weft::daemon::runs
