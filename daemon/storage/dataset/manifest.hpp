#pragma once
// A list of recordings: which file holds what.

#include <filesystem>
#include <string>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::daemon {

struct ManifestEntry {
  std::string file;            ///< as written
  std::filesystem::path path;  ///< relative to the manifest's folder
  std::string label;
  std::string group;  ///< empty where the manifest has no such column
  std::string where;  ///< manifest:line
};

/// A CSV with columns `file,label[,group]` in any order (quoted fields allowed); other columns, an
/// empty file or label, a file listed twice (under whatever name: `./a.csv`, a link) and a list
/// without files are refused with file:line.
Result<std::vector<ManifestEntry>> read_manifest(const std::filesystem::path& path);

}  // namespace weft::daemon
