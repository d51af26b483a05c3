#include "daemon/campaign/open_rig.hpp"
#include "daemon/base/file/read_file.hpp"

namespace weft::daemon {

Result<OpenedRig> open_rig(const std::filesystem::path& path, const PluginSettings& plugins) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return pass(text.error());
  const Result<recipes::RigLimits> limits = recipes::parse_rig_limits(*text);
  if (!limits) return pass(limits.error(), path.string());
  Result<RigFile> file = parse_rig_file(*text);
  if (!file) return pass(file.error(), path.string());
  use_plugins(*file, path, plugins);
  return OpenedRig{std::move(*file), *limits};
}

}  // namespace weft::daemon
