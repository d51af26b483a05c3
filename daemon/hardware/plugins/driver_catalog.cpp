#include "daemon/hardware/plugins/driver_catalog.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

// Does not use standard streams: the thread that hangs may have locked them.
void end_process(const Error& error) {
  const std::string line = "weft: " + to_string(error) + "\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, line.data(), line.size());
  ::_exit(EXIT_FAILURE);
}

const DriverEntry* builtin_named(const std::string& driver) {
  const auto all = builtin_drivers();
  const auto at =
      std::find_if(all.begin(), all.end(), [&](const DriverEntry* e) { return driver == e->name; });
  return at == all.end() ? nullptr : *at;
}

/// The files for one driver, one folder after the other. Errors: not_found for a folder.
Result<std::vector<fs::path>> files_for(const std::string& driver,
                                        const std::vector<fs::path>& folders) {
  std::vector<fs::path> files;
  for (const fs::path& folder : folders) {
    std::error_code error;
    if (!fs::is_directory(folder, error))
      return fail({.code = Errc::not_found,
                   .what = "plugin folder not found",
                   .expected = "a folder with " + plugin_file_name("NAME"),
                   .got = folder.string(),
                   .hint = "Check --plugins, WEFT_PLUGIN_PATH and `plugins` of the rig file"});
    const fs::path file = folder / plugin_file_name(driver);
    const auto same = [&](const fs::path& other) { return fs::equivalent(other, file, error); };
    if (fs::exists(file, error) && std::none_of(files.begin(), files.end(), same))
      files.push_back(file);
  }
  return files;
}

tl::unexpected<Error> taken_twice(const std::string& driver, const std::string& first,
                                  const std::string& second, const std::string& hint) {
  return fail({.code = Errc::invalid_argument,
               .what = "several drivers have the name " + driver,
               .expected = "one",
               .got = first + " and " + second,
               .hint = hint});
}

std::string joined(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name;
  return out.empty() ? "none" : out;
}

Error hung_error(const PluginCall& call, std::chrono::milliseconds limit) {
  return {.code = Errc::driver,
          .where = std::string(call.device) + ": " + call.file,
          .what = "driver call " + std::string(call.function) +
                  " does not return, so weft exits and the stages stop by themselves",
          .expected = "less than " + std::to_string(limit.count()) + " ms",
          .got = "no return",
          .hint = "Report the fault to the author of the driver; the recorded data is kept"};
}

}  // namespace

DriverCatalog::DriverCatalog(PluginSettings settings) : settings_(std::move(settings)) {
  if (!settings_.hung) settings_.hung = end_process;
}

DriverCatalog::~DriverCatalog() = default;

// Starts its thread only when there is a plugin to watch.
PluginWatch& DriverCatalog::watch() {
  if (!watch_)
    watch_ = std::make_unique<PluginWatch>(settings_.limits, [this](const PluginCall& call) {
      settings_.hung(hung_error(call, settings_.limits.hung));
    });
  return *watch_;
}

std::vector<std::string> DriverCatalog::names() const {
  std::vector<std::string> out;
  if (settings_.builtins)
    for (const DriverEntry* entry : builtin_drivers()) out.emplace_back(entry->name);
  for (const fs::path& folder : settings_.folders) {
    std::error_code error;
    for (const auto& file : fs::directory_iterator(folder, error))
      if (const std::string name = load_driver(file.path()); !name.empty()) out.push_back(name);
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

std::vector<fs::path> DriverCatalog::plugin_files() const {
  std::vector<fs::path> out;
  for (const fs::path& folder : settings_.folders) {
    std::error_code error;
    if (!fs::is_directory(folder, error)) continue;
    out.push_back(folder);
    const std::size_t begin = out.size();
    for (fs::directory_iterator file(folder, error), end; !error && file != end;
         file.increment(error))
      if (!load_driver(file->path()).empty()) out.push_back(file->path());
    std::sort(out.begin() + static_cast<std::ptrdiff_t>(begin), out.end());
  }
  return out;
}

Result<const LoadedPlugin*> DriverCatalog::loaded(const std::string& driver, const fs::path& file) {
  if (const auto known = plugins_.find(driver); known != plugins_.end()) return &known->second;
  Result<LoadedPlugin> plugin = load_plugin(file);
  if (!plugin) {
    Error error = plugin.error();
    error.what = "plugin " + error.where + " rejected, " + error.what;
    error.where.clear();
    return pass(std::move(error));
  }
  return &plugins_.emplace(driver, std::move(*plugin)).first->second;
}

Result<DriverCatalog::Found> DriverCatalog::find(const std::string& driver) {
  const Result<std::vector<fs::path>> files = files_for(driver, settings_.folders);
  if (!files) return pass(files.error());
  const DriverEntry* builtin = settings_.builtins ? builtin_named(driver) : nullptr;
  if (files->size() > 1)
    return taken_twice(driver, files->at(0).string(), files->at(1).string(), "Remove one file");
  if (builtin != nullptr && !files->empty())
    return taken_twice(driver, "the built-in driver", files->front().string(),
                       "Remove the file, or exclude built-in drivers with --plugins-only");
  if (builtin != nullptr) return Found{builtin, nullptr};
  if (files->empty())
    return fail({.code = Errc::not_found,
                 .what = "unknown driver",
                 .expected = joined(names()),
                 .got = driver,
                 .hint = "For a plugin, put " + plugin_file_name(driver) +
                         " into a folder of --plugins, WEFT_PLUGIN_PATH or `plugins` of the "
                         "rig file"});
  const Result<const LoadedPlugin*> plugin = loaded(driver, files->front());
  if (!plugin) return pass(plugin.error());
  return Found{nullptr, *plugin};
}

Result<std::unique_ptr<Driver>> DriverCatalog::create(const std::string& driver,
                                                      const std::string& device,
                                                      std::string_view config_json,
                                                      DriverHost& host) {
  const Result<Found> found = find(driver);
  if (!found) return pass(found.error());
  if (found->builtin != nullptr) return found->builtin->create(config_json, host);
  return PluginDriver::create(*found->plugin, device, config_json, host, watch());
}

Result<DriverSource> DriverCatalog::source(const std::string& driver) {
  const Result<Found> found = find(driver);
  if (!found) return pass(found.error());
  if (found->builtin != nullptr)
    return DriverSource{
        driver, found->builtin->summary, {}, {}, found->builtin->config_schema_json};
  const weft_driver_entry_v1& table = *found->plugin->table;
  return DriverSource{driver, table.summary, found->plugin->file, table.build_fingerprint,
                      table.config_schema_json};
}

}  // namespace weft::daemon
