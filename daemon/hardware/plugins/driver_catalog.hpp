#pragma once
// Sources of a rig's drivers: those linked into this program, and plugins (shared objects) in
// folders. Loads only the drivers of the rig.

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/hardware/plugins/plugin_driver.hpp"
#include "drivers/api/driver.hpp"

namespace weft::daemon {

/// The drivers linked into this program: one per folder of drivers/, listed by CMake.
std::span<const DriverEntry* const> builtin_drivers();

// One plugin: checked before any of its code is called.

/// "weft-driver-NAME.so"
std::string plugin_file_name(std::string_view driver);
/// NAME of such a file name; empty for any other file.
std::string load_driver(const std::filesystem::path& file);

/// Refuses a table that this program cannot call; reads version and size first. Errors:
/// unsupported, with the expected value and the plugin's.
Status check_table(const weft_driver_entry_v1& table);

/// Loads the file and checks its table. Its driver must have the name in the file's name. Errors:
/// not_found, unsupported (no shared object, no driver in it, another ABI).
Result<LoadedPlugin> load_plugin(const std::filesystem::path& file);

/// Reports that a call into a plugin does not return, and ends the process. Called on another
/// thread than the loop's, which hangs: the process cannot continue.
using PluginHung = std::function<void(const Error&)>;

struct PluginSettings {
  std::vector<std::filesystem::path> folders;
  bool builtins = true;  ///< false: drivers come from the folders only
  PluginWatch::Limits limits = {};
  PluginHung hung = {};  ///< empty: writes the error to standard error and ends the process
};

/// One driver that a rig can name.
struct DriverSource {
  std::string name;
  std::string summary;
  std::string file;                     ///< of a plugin; empty for a built-in driver
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

  /// Makes a driver for one device. Errors: not_found, with the known names; unsupported for an
  /// unusable plugin; invalid_argument if two drivers have the name; the driver's own.
  Result<std::unique_ptr<Driver>> create(const std::string& driver, const std::string& device,
                                         std::string_view config_json, DriverHost& host);
  /// Errors: as create(), without the driver's own.
  Result<DriverSource> source(const std::string& driver);
  /// Names of all drivers; those of plugins by their file names, without loading them.
  [[nodiscard]] std::vector<std::string> names() const;
  /// The existing folders, each before its plugins, without loading them. The set of drivers
  /// changes only with these files.
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
