// The common behaviour of all drivers.

#include "drivers/api/driver_base.hpp"

#include <stdexcept>

#include "tests/unit/drivers/fakes.hpp"

namespace driver_base_test {

using namespace weft;
using namespace weft::testing;

namespace {

/// Throws on any byte, like a faulty parser.
class FragileDriver final : public DriverBase {
 public:
  using DriverBase::DriverBase;
  Status open() override { return attach(); }
  Status arm() override { return {}; }
  Result<std::uint32_t> command(const Command&) override { return 0; }
  void stop() override {}
  void close() override { detach(); }

 private:
  void received(ByteView bytes, TimePoint) override {
    if (bytes[0] == 1) throw std::out_of_range("basic_string::substr\nof a reply");
  }
  void make_safe() noexcept override {}
};

}  // namespace

TEST_CASE("what a driver throws on received bytes is a fault of the device, in one line") {
  FakeHost host;
  FragileDriver driver(host);
  REQUIRE(driver.open());
  host.link_.deliver(Bytes{0}, {});
  CHECK(host.faults.empty());
  host.link_.deliver(Bytes{1}, {});
  REQUIRE(host.faults.size() == 1);
  CHECK(host.faults[0].code == Errc::driver);
  CHECK(host.faults[0].got == "basic_string::substr");
  CHECK(driver.state() == DriverState::faulted);
  CHECK_FALSE(host.link_.listened_to());
}

}  // namespace driver_base_test
