#pragma once
// Which other programs hold a lock on a file, by what the kernel lists.

#include <filesystem>
#include <string>
#include <vector>

namespace weft::daemon {

/// "sqlite3 (process 71)" for every other process with a lock on one of the files, joined by
/// commas; empty where none is seen. Opens none of the files. A file without a name any more has no
/// holder, and a holder in another container is not seen.
std::string file_holders(const std::vector<std::filesystem::path>& files);

/// Whether another program holds a lock on the file that keeps readers out (flock, as HDF5 takes
/// it). Never of a file of SQLite: opening and closing it here would release this process's own
/// locks.
bool is_locked_by_another(const std::filesystem::path& file);

}  // namespace weft::daemon
