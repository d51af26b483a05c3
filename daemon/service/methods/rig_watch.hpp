#pragma once
// What is wrong with the rig file, for whoever comes to the daemon.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/hardware/rig/rig_file.hpp"

namespace weft::daemon::api {

/// Looks the file over as recipe.check does, short of what a recipe has to do with it; again only
/// once its text, or that of its cloth table, is another, or there are other plugins.
class RigWatch {
 public:
  /// Sentences; none where the rig can be run.
  const std::vector<std::string>& problems(const std::filesystem::path& file,
                                           const std::string& text);

 private:
  std::optional<RigFile> rig_;  ///< as it was looked at; none where it could not be read
  std::optional<std::string> text_, fabrics_;
  std::vector<std::filesystem::path> plugins_;  ///< that there were, and their folders
  std::vector<std::string> problems_;
};

}  // namespace weft::daemon::api
