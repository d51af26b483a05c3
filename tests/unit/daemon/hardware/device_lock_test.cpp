// Only one program at a time has a device; a second set of locks in one process represents another
// program.
#include "daemon/hardware/rig/device_lock.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>

namespace device_lock_test {

using namespace weft;
using namespace weft::daemon;

namespace {

struct Folder {
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "weft-locks-XXXXXX").string();
    REQUIRE(::mkdtemp(name.data()) != nullptr);
    path = name;
  }
  ~Folder() { std::filesystem::remove_all(path); }
  std::filesystem::path path;
};

DeviceEntry device(LinkSettings link) {
  DeviceEntry entry;
  entry.name = "stage.z";
  entry.link = std::move(link);
  return entry;
}

TEST_CASE("A device is locked once, and free again when its locks are gone") {
  const Folder folder;
  const DeviceEntry stage = device(TcpPort{{"127.0.0.1", 7101}});
  {
    DeviceLocks first(folder.path);
    REQUIRE(first.acquire(stage, "bench17"));
    CHECK(first.acquire(stage, "bench17"));  // the same port again
    CHECK(first.descriptors().size() == 1);
    DeviceLocks second(folder.path);
    const Status refused = second.acquire(stage, "other");
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == Errc::busy);
    CHECK(refused.error().where.find("stage.z") == 0);
    CHECK(refused.error().got.find("process " + std::to_string(::getpid()) + " of ") !=
          std::string::npos);
    CHECK(refused.error().got.find("rig bench17") != std::string::npos);
  }
  CHECK(std::filesystem::is_empty(folder.path));
  CHECK(DeviceLocks(folder.path).acquire(stage, "other"));
}

TEST_CASE("One device by two names is one device") {
  const Folder folder;
  const std::filesystem::path port = folder.path / "ttyUSB0", by_id = folder.path / "by-id";
  std::ofstream(port).close();
  std::filesystem::create_symlink(port, by_id);
  const std::pair<LinkSettings, LinkSettings> names[] = {
      {SerialSettings{port.string()}, SerialSettings{by_id.string()}},
      {TcpPort{{"127.0.0.1", 7101}}, TcpPort{{"localhost", 7101}}},
      {UdpPort{{"127.0.0.1", 49152}}, UdpPort{{"localhost", 49152}, 5000}}};
  for (const auto& [one, other] : names) {
    DeviceLocks first(folder.path), second(folder.path);
    REQUIRE(first.acquire(device(one), "a"));
    CHECK_FALSE(second.acquire(device(other), "b"));
  }
}

TEST_CASE("The page of a device is locked with it, other ports are not") {
  const Folder folder;
  DeviceEntry box = device(UdpPort{{"127.0.0.1", 49152}});
  box.http = TcpPort{{"127.0.0.1", 80}};
  DeviceLocks first(folder.path), second(folder.path);
  REQUIRE(first.acquire(box, "a"));
  CHECK_FALSE(second.acquire(device(TcpPort{{"127.0.0.1", 80}}), "b"));
  CHECK(second.acquire(device(TcpPort{{"127.0.0.1", 49152}}), "b"));
  CHECK(second.acquire(device(UdpPort{{"127.0.0.2", 49152}}), "b"));
  CHECK(second.acquire(device(MemoryPort{}), "b"));
}

TEST_CASE("A folder that cannot take a lock is an error, not a lock") {
  const Status refused = DeviceLocks("/nowhere").acquire(device(TcpPort{{"127.0.0.1", 7101}}), "a");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::io);
}

}  // namespace
}  // namespace device_lock_test
