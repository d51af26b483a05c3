// The units that a stage driver accepts as its own.

#include "tests/unit/drivers/stage_bench.hpp"

namespace stage_identity_test {

using namespace weft;
using namespace weft::testing;

TEST_CASE("another controller, another stage or another stage id is refused on opening") {
  struct Case {
    StageBench bench;
    const char* model;
    std::uint16_t stage_id;
    bool accepted;
    Errc refused_as = Errc::device_identity;
  };
  Case cases[] = {
      {StageBench::lts(), "LTS150", 0, true},
      {StageBench::lts(), "BSC201", 0, true},
      {StageBench::lts(), "LTS300", 0, false},
      {StageBench::lts(), "KDC101", 6, false},
      {StageBench::lts(), "", 0, false},
      {StageBench::prm(), "TDC001", 1, true},
      {StageBench::prm(), "KDC101", 8, false, Errc::device_settings},
      {StageBench::prm(), "LTS150", 0, false},
      {StageBench::prm(R"(, "channel": 2)"), "KDC101", 6, false, Errc::device_settings}};
  for (Case& c : cases) {
    INFO(c.model << " stage " << c.stage_id);
    REQUIRE(c.bench.driver->open());
    c.bench.link().take_written();
    c.bench.receive_info(c.model, c.stage_id);
    CHECK((c.bench.driver->state() == DriverState::open) == c.accepted);
    if (c.accepted) continue;
    CHECK(c.bench.fault_code() == c.refused_as);
    CHECK(c.bench.link().take_written().empty());  // not our stage: no further byte
  }
}

TEST_CASE("a stage is refused by name on a controller without a known scale for it") {
  struct Case {
    const char* stage;
    const char* model;
    bool accepted;
  };
  for (const Case& c : {Case{"NRT150", "BSC201", true},
                        {"NRT150", "BSC203", true},
                        {"NRT150", "SCC201", true},
                        {"NRT150", "BSC101", false},
                        {"NRT150", "BSC103", false},
                        {"NRT150", "SCC101", false},
                        {"NRT150", "TST001", false},
                        {"NRT150", "TST101", false},
                        {"NRT150", "KST101", false},
                        {"LTS150", "BSC202", true},
                        {"LTS150", "BSC101", false},
                        {"LTS150", "TST001", false},
                        {"CR1-Z7", "TDC001", true},
                        {"PRM1-Z8", "BBD201", false},
                        {"PRM1-Z8", "KBD101", false},
                        {"K10CR1", "K10CR1", true},
                        {"K10CR1", "BSC201", false}}) {
    INFO(c.stage << " on " << c.model);
    StageBench bench(R"({"stage": ")" + std::string(c.stage) + R"("})");
    REQUIRE(bench.driver->open());
    bench.link().take_written();
    bench.receive_info(c.model);
    CHECK((bench.driver->state() == DriverState::open) == c.accepted);
    if (c.accepted) continue;
    CHECK(bench.fault_code() == Errc::device_identity);
    CHECK(bench.fault().what.find(c.stage) != std::string::npos);
    CHECK(bench.fault().got == c.model);
    CHECK(bench.link().take_written().empty());
  }
}

}  // namespace stage_identity_test
