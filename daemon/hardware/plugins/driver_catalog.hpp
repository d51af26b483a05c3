#pragma once
// Where the drivers of a rig come from: those linked into this program, and shared objects in
// folders. Only what a rig asks for is loaded.

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

// One shared object with a driver in it: found in order before anything in it is called.

/// "weft-driver-NAME.so"
std::string plugin_file_name(std::string_view driver);
/// NAME of such a file name; empty when it is another one.
std::string load_driver(const std::filesystem::path& file);

/// Refuses a table that this program cannot call; reads version and size before all else.
/// Errors: unsupported, with what was expected and what the plugin has.
Status check_table(const weft_driver_entry_v1& table);

/// Loads the file and checks its table; its driver must be the one that the file's name says.
/// Errors: not_found, unsupported (no shared object, no driver in it, another ABI).
Result<LoadedPlugin> load_plugin(const std::filesystem::path& file);

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
