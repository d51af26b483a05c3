#include "daemon/service/methods/services.hpp"

#include "daemon/campaign/bench_check.hpp"
#include "daemon/campaign/bench_session.hpp"

namespace weft::daemon::api {
namespace {

std::optional<std::string> load_fabric_names(const std::optional<RigFile>& rig,
                                             const std::filesystem::path& file) {
  if (!rig || rig->mode == BenchMode::real) return std::nullopt;
  auto text = read_fabrics(*rig, file);
  return text ? std::optional(std::move(*text)) : std::nullopt;
}

std::vector<std::filesystem::path> list_plugins(const std::optional<RigFile>& rig) {
  return rig ? rig->drivers->plugin_files() : std::vector<std::filesystem::path>();
}

}  // namespace

const std::vector<std::string>& RigWatch::problems(const std::filesystem::path& file,
                                                   const std::string& text) {
  if (text == text_ && load_fabric_names(rig_, file) == fabrics_ && list_plugins(rig_) == plugins_)
    return problems_;
  text_ = text;
  rig_.reset();
  problems_.clear();
  plugins_.clear();
  auto opened = open_rig(file, {});
  if (!opened) {
    problems_.push_back(to_string(opened.error()));
  } else {
    plugins_ = opened->file.drivers->plugin_files();  // before they are looked for
    for (const recipes::Diagnostic& problem : check_rig(*opened, file, PluginDrivers::unread))
      problems_.push_back(recipes::to_string(problem));
    rig_ = std::move(opened->file);
  }
  fabrics_ = load_fabric_names(rig_, file);
  return problems_;
}

}  // namespace weft::daemon::api
