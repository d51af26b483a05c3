#pragma once
// Where the drivers of a rig come from: those linked into this program, and shared objects in
// folders. Only what a rig asks for is loaded.

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/hardware/plugins/plugin_driver.hpp"

namespace weft::daemon {

/// Says that a plugin's code does not come back. Called on another thread than the loop's, which is
/// lost: the process cannot go on, and this ends it.
using PluginHung = std::function<void(const Error&)>;

struct PluginSettings {
  std::vector<std::filesystem::path> folders;
  bool builtins = true;  ///< false: drivers come from the folders alone
  PluginWatch::Limits limits = {};
  PluginHung hung = {};  ///< empty: the sentence goes to standard error and the process ends
};

/// One driver that a rig may name.
struct DriverSource {
  std::string name;
  std::string summary;
  std::string file;                     ///< of a plugin; empty for one that is built in
  std::string fingerprint;              ///< of a plugin
  std::string config_schema_json = {};  ///< JSON Schema of its configuration
};

/// Thread-bound. Outlives the drivers that it makes.
class DriverCatalog {
 public:
  explicit DriverCatalog(PluginSettings settings = {});
  ~DriverCatalog();
  DriverCatalog(const DriverCatalog&) = delete;
  DriverCatalog& operator=(const DriverCatalog&) = delete;

  /// Makes a driver for one device. Errors: not_found, with the names there are; unsupported, for a
  /// plugin that cannot be used; invalid_argument, when the name is taken twice; the driver's own.
  Result<std::unique_ptr<Driver>> create(const std::string& driver, const std::string& device,
                                         std::string_view config_json, DriverHost& host);
  /// Errors: as create(), short of the driver's own.
  Result<DriverSource> source(const std::string& driver);
  /// Names of all drivers; plugins by the names of their files, unread.
  [[nodiscard]] std::vector<std::string> names() const;
  /// The folders that are there, each before the plugins in it, unread: which drivers there are
  /// changes with these alone.
  [[nodiscard]] std::vector<std::filesystem::path> plugin_files() const;

 private:
  struct Found {
    const DriverEntry* builtin = nullptr;
    const LoadedPlugin* plugin = nullptr;
  };
  Result<Found> find(const std::string& driver);
  Result<const LoadedPlugin*> loaded(const std::string& driver, const std::filesystem::path& file);
  PluginWatch& watch();

  PluginSettings settings_;
  std::map<std::string, LoadedPlugin> plugins_;
  std::unique_ptr<PluginWatch> watch_;
};

}  // namespace weft::daemon
