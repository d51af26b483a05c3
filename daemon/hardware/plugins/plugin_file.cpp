#include "daemon/hardware/plugins/driver_catalog.hpp"

#include <dlfcn.h>

#include <array>
#include <fstream>

namespace weft::daemon {
namespace {

constexpr std::string_view prefix = "weft-driver-";
constexpr std::string_view suffix = ".so";
constexpr std::string_view symbol = "weft_driver_v1";
constexpr std::string_view rebuild = "Build the driver again with the SDK of this Weft version";
// Size of the first version 1. Later members follow it and may be missing.
constexpr std::uint32_t least_size = 96;

/// The part that must agree; the compiler follows the bar.
std::string_view layout_of(std::string_view fingerprint) {
  const std::size_t bar = fingerprint.find('|');
  std::string_view layout = fingerprint.substr(0, bar);
  while (layout.ends_with(' ')) layout.remove_suffix(1);
  return layout;
}

tl::unexpected<Error> refuse(std::string message, std::string expected, std::string got) {
  return fail({.code = Errc::unsupported,
               .what = std::move(message),
               .expected = std::move(expected),
               .got = std::move(got),
               .hint = std::string(rebuild)});
}

Status check_functions(const weft_driver_entry_v1& table) {
  const std::array<std::pair<const char*, bool>, 10> parts{
      {{"name", table.name != nullptr},
       {"summary", table.summary != nullptr},
       {"config_schema_json", table.config_schema_json != nullptr},
       {"create", table.create != nullptr},
       {"destroy", table.destroy != nullptr},
       {"open", table.open != nullptr},
       {"arm", table.arm != nullptr},
       {"command", table.command != nullptr},
       {"stop", table.stop != nullptr},
       {"close", table.close != nullptr}}};
  for (const auto& [name, there] : parts)
    if (!there) return refuse("function missing in the driver table", name, "none");
  return {};
}

/// The messages of dlopen() for these cases name neither the expected nor the actual kind.
Status check_kind(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in)
    return fail({.code = Errc::not_found,
                 .where = file.string(),
                 .what = "plugin not readable",
                 .expected = "a readable file"});
  std::array<char, 4> magic{};
  in.read(magic.data(), magic.size());
  if (in.gcount() == 4 && std::string_view(magic.data(), 4) == "\177ELF") return {};
  return fail({.code = Errc::unsupported,
               .where = file.string(),
               .what = "plugin is not a shared object",
               .expected = "an ELF file",
               .got = in.gcount() == 0 ? "an empty file" : "a file of another kind",
               .hint = std::string(rebuild)});
}

std::string loader_error_text() {
  const char* words = ::dlerror();
  return words == nullptr ? "no reason given" : words;
}

}  // namespace

std::string plugin_file_name(std::string_view driver) {
  return std::string(prefix) + std::string(driver) + std::string(suffix);
}

std::string load_driver(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  const std::string_view text = name;
  if (text.size() <= prefix.size() + suffix.size() || !text.starts_with(prefix) ||
      !text.ends_with(suffix))
    return {};
  return name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
}

Status check_table(const weft_driver_entry_v1& table) {
  if (table.abi_version != WEFT_DRIVER_ABI_VERSION)
    return refuse("driver built for another plugin ABI",
                  "version " + std::to_string(WEFT_DRIVER_ABI_VERSION),
                  "version " + std::to_string(table.abi_version));
  if (table.struct_size < least_size || table.struct_size > sizeof(weft_driver_entry_v1))
    return refuse("wrong size of the driver table",
                  std::to_string(sizeof(weft_driver_entry_v1)) + " bytes",
                  std::to_string(table.struct_size) + " bytes");
  const std::string_view built = table.build_fingerprint == nullptr ? "" : table.build_fingerprint;
  if (layout_of(built) != layout_of(WEFT_DRIVER_FINGERPRINT))
    return refuse("wrong build fingerprint of the driver",
                  std::string(layout_of(WEFT_DRIVER_FINGERPRINT)),
                  built.empty() ? "none" : std::string(built));
  return check_functions(table);
}

Result<LoadedPlugin> load_plugin(const std::filesystem::path& file) {
  const std::string path = std::filesystem::absolute(file).string();
  if (Status ok = check_kind(path); !ok) return pass(ok.error());
  // The library stays loaded to the end, so that its remaining threads or handlers still find their
  // code.
  void* const library = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (library == nullptr)
    return fail({.code = Errc::unsupported,
                 .where = path,
                 .what = "plugin not loaded",
                 .expected = "a shared object that loads",
                 .got = loader_error_text(),
                 .hint = std::string(rebuild)});
  LoadedPlugin plugin{std::shared_ptr<void>(library, [](void* open) { ::dlclose(open); }), nullptr,
                      path};
  plugin.table = static_cast<const weft_driver_entry_v1*>(::dlsym(library, symbol.data()));
  if (plugin.table == nullptr)
    return fail({.code = Errc::unsupported,
                 .where = path,
                 .what = "plugin exports no driver",
                 .expected = "symbol " + std::string(symbol),
                 .hint = "Add WEFT_EXPORT_DRIVER to its source (docs/howto/own-device.md)"});
  if (Status ok = check_table(*plugin.table); !ok) return pass(ok.error(), path);
  if (plugin.table->name != load_driver(path))
    return fail({.code = Errc::unsupported,
                 .where = path,
                 .what = "file name differs from the driver name",
                 .expected = plugin_file_name(plugin.table->name),
                 .got = file.filename().string(),
                 .hint = "Rename the file"});
  return plugin;
}

}  // namespace weft::daemon
