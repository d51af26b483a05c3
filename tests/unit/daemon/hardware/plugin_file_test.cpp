// Shared objects that must be refused, each with the expected and the found value.

#include <catch2/catch.hpp>

#include "daemon/hardware/plugins/driver_catalog.hpp"
#include "tests/unit/drivers/fakes.hpp"
#include "tests/unit/temporary_folder.hpp"

namespace plugin_file_test {

using namespace weft;
using namespace weft::daemon;
using weft::daemon::test::TemporaryFolder;

namespace {

namespace fs = std::filesystem;
const fs::path plugins = WEFT_TEST_PLUGINS;

Error refused(const std::string& name) {
  const auto loaded = load_plugin(plugins / plugin_file_name(name));
  REQUIRE_FALSE(loaded);
  CHECK(loaded.error().where == (plugins / plugin_file_name(name)).string());
  CHECK_FALSE(loaded.error().hint.empty());
  return loaded.error();
}

void put(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

DriverCatalog catalog(std::vector<fs::path> folders, bool builtins = true) {
  return DriverCatalog({std::move(folders), builtins, {}, {}});
}

}  // namespace

TEST_CASE("a plugin in plain C is loaded, opened and armed") {
  DriverCatalog drivers({{plugins}, true, {std::chrono::minutes(1), std::chrono::minutes(2)}, {}});
  weft::testing::FakeHost host;
  const auto driver = drivers.create("none", "device", "{}", host);
  REQUIRE(driver);
  REQUIRE((*driver)->open());
  REQUIRE((*driver)->arm());
  CHECK((*driver)->state() == DriverState::armed);
  CHECK((*driver)->command(HomeCommand{}).error().what == "nothing here moves");
  (*driver)->close();
  CHECK((*driver)->state() == DriverState::closed);
  CHECK(drivers.source("none")->summary == "Does nothing");
}

TEST_CASE("a plugin that this weft cannot call is refused with the expected and the found value") {
  const auto says = [](const std::string& name, const std::string& expected,
                       const std::string& got) {
    CAPTURE(name);
    const Error error = refused(name);
    CHECK(error.expected.find(expected) != std::string::npos);
    CHECK(error.got.find(got) != std::string::npos);
  };
  says("wrong_abi", "version 1", "version 99");
  says("wrong_size", "96 bytes", "88 bytes");
  says("newer_size", "96 bytes", "104 bytes");
  says("wrong_fingerprint", "weft C ABI 1, ", "pdp11");
  says("missing_symbol", "weft_driver_v1", "");
  says("hole", "stop", "none");
  says("other_name", "weft-driver-somebody_else.so", "weft-driver-other_name.so");
}

TEST_CASE("a file that is no shared object is refused with its kind") {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& name) {
    return load_plugin(folder / plugin_file_name(name)).error();
  };
  CHECK(refusal("absent").code == Errc::not_found);
  put(folder / plugin_file_name("script"), "#!/bin/sh\n");
  CHECK(refusal("script").expected == "an ELF file");
  CHECK(refusal("script").got == "a file of another kind");
  put(folder / plugin_file_name("empty"), "");
  CHECK(refusal("empty").got == "an empty file");
  put(folder / plugin_file_name("cut"), "\177ELF and then nothing");
  CHECK(refusal("cut").code == Errc::unsupported);
  CHECK(refusal("cut").expected != "an ELF file");
  CHECK_FALSE(refusal("cut").got.empty());
}

TEST_CASE("two drivers of one name are refused, wherever they come from") {
  const TemporaryFolder folder;
  put(folder / "a/weft-driver-none.so", "x");
  put(folder / "b/weft-driver-none.so", "x");
  put(folder / "b/weft-driver-taxel_array.so", "x");
  auto both = catalog({folder / "a", folder / "b"});
  const Error twice = both.source("none").error();
  CHECK(twice.got.find("a/weft-driver-none.so") != std::string::npos);
  CHECK(twice.got.find("b/weft-driver-none.so") != std::string::npos);
  const Error shadow = both.source("taxel_array").error();
  CHECK(shadow.got.find("built-in") != std::string::npos);
  CHECK(shadow.hint.find("--plugins-only") != std::string::npos);
  auto only = catalog({folder / "b"}, false);
  CHECK(only.source("taxel_array").error().expected == "an ELF file");
  auto same_folder = catalog({folder / "a", folder / "a"});
  CHECK(same_folder.source("none").error().expected == "an ELF file");
}

TEST_CASE("an unknown driver is reported with the known names, a missing folder with its path") {
  auto drivers = catalog({plugins});
  const Error unknown = drivers.source("taxel_aray").error();
  CHECK(unknown.code == Errc::not_found);
  CHECK(unknown.expected.find("taxel_array") != std::string::npos);
  CHECK(unknown.expected.find("taxel_array_misbehaving") != std::string::npos);
  CHECK(unknown.hint.find("weft-driver-taxel_aray.so") != std::string::npos);
  auto lost = catalog({"/nowhere/at/all"});
  CHECK(lost.source("taxel_array").error().got == "/nowhere/at/all");
}

TEST_CASE("only names of the form weft-driver-NAME.so are plugins") {
  CHECK(load_driver("/a/weft-driver-balance.so") == "balance");
  for (const char* name : {"weft-driver-.so", "libbalance.so", "weft-driver-balance.so.1", ".so"})
    CHECK(load_driver(name).empty());
}

}  // namespace plugin_file_test
