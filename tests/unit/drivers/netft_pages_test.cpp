// The pages of a Net F/T box: the values that the driver uses, and boxes with bad answers.

#include <catch2/catch.hpp>
#include <memory>

#include "drivers/ati_netft/netft_driver.hpp"
#include "protocols/rdt/rdt.hpp"
#include "tests/unit/drivers/fakes.hpp"

namespace netft_pages_test {

using namespace weft;
using namespace weft::testing;
namespace rdt = protocols::rdt;

namespace {

struct PagedBench : DriverBench {
  explicit PagedBench(const std::string& config = "{}")
      : DriverBench(drivers::ati_netft_entry, config) {
    host.http_ = std::make_unique<FakeLink>();
    REQUIRE(driver->open());
  }
  FakeLink& http() { return *host.http_; }
  void answer(const std::string& text, std::size_t piece = 1000) {
    for (std::size_t at = 0; at < text.size(); at += piece) {
      const std::string_view part = std::string_view(text).substr(at, piece);
      http().deliver({reinterpret_cast<const std::uint8_t*>(part.data()), part.size()},
                     host.loop_.now());
    }
  }
  void answer_page(const std::string& xml) { answer(rdt::http_reply(200, "text/xml", xml)); }
  std::string requested() {
    const Bytes bytes = http().take_written();
    const std::string text(bytes.begin(), bytes.end());
    return text.substr(0, text.find(" HTTP"));
  }
  void receive_record() {
    Bytes datagram;
    append(datagram, rdt::Record{1, 1, 0, {}, {}});
    receive(datagram);
  }
  std::string reported(const std::string& key) const {
    REQUIRE(host.identities.size() == 1);
    for (const auto& [name, value] : host.identities[0].reported)
      if (name == key) return value;
    return "";
  }
};

const std::string minimal =
    "<netft><cfgcpf>500000</cfgcpf><cfgcpt>1000000</cfgcpt>"
    "<scfgfu>N</scfgfu><scfgtu>Nm</scfgtu></netft>";

}  // namespace

TEST_CASE("both pages are read, one after the other, before the first record is asked for") {
  PagedBench bench(R"({"calibration_serial": "FT12288"})");
  CHECK(bench.requested() == "GET /netftapi2.xml");
  bench.answer_page(rdt::encode(rdt::SettingsPage{}));
  CHECK(bench.requested() == "GET /netftcalapi.xml");
  CHECK(bench.host.link_.take_written().empty());
  bench.answer_page(rdt::encode(rdt::CalibrationPage{"FT12288"}));
  CHECK_FALSE(bench.host.link_.take_written().empty());
  bench.receive_record();
  CHECK(bench.driver->state() == DriverState::open);
  CHECK(bench.reported("calibration_serial") == "FT12288");
  CHECK(bench.reported("product") == "Net F/T");
}

TEST_CASE("a box without a calibration page or product opens where nothing needs them") {
  const std::string not_found = rdt::http_reply(404, "text/html", "No such page\n");
  for (const std::string& answer : {not_found, rdt::http_reply(200, "text/xml", "<x></x>"),
                                    std::string("HTTP/1."), std::string("rubbish")}) {
    INFO(answer);
    PagedBench bench;
    bench.answer_page(minimal);
    bench.answer(answer);
    if (answer == "HTTP/1.") bench.http().break_off();
    bench.receive_record();
    CHECK(bench.host.faults.empty());
    CHECK(bench.driver->state() == DriverState::open);
    CHECK(bench.host.identities.at(0).scale.at(0).second == Approx(500000));
    CHECK(bench.reported("product").empty());
    CHECK(bench.reported("calibration_serial").empty());
    CHECK(bench.host.logs.size() == 1);
  }
}

TEST_CASE("a calibration page that does not come is gone without; the settings' serial may do") {
  PagedBench silent;
  silent.answer_page(minimal);
  silent.host.loop_.run_for(1.6);  // three reply_timeout_s of 0.5 s
  silent.receive_record();
  CHECK(silent.driver->state() == DriverState::open);

  rdt::SettingsPage page;
  page.calibration_serial = "FT12288";
  PagedBench same(R"({"calibration_serial": "FT12288"})"),
      other(R"({"calibration_serial": "FT1"})");
  for (PagedBench* bench : {&same, &other}) {
    bench->answer_page(rdt::encode(page));
    bench->answer(rdt::http_reply(404, "text/html", "none"));
  }
  same.receive_record();
  CHECK(same.driver->state() == DriverState::open);
  CHECK(other.fault().where == "/calibration_serial");
  CHECK(other.fault_code() == Errc::device_identity);
}

TEST_CASE("a rig file's calibration that is on no page is refused in one line") {
  PagedBench bench(R"({"calibration_serial": "FT12288"})");
  bench.answer_page(minimal);
  bench.answer("HTTP/1.1 404 Not Found\r\nServer: box\r\nX: y\r\n\r\n");
  CHECK(bench.fault_code() == Errc::device_identity);
  const std::string text = to_string(bench.fault());
  CHECK(text.find_first_of("\r\n") == std::string::npos);
  CHECK(text.find("404 Not Found") != std::string::npos);
  CHECK(text.find("Server") == std::string::npos);
}

TEST_CASE("a settings page that is no page is a fault of the device, in any pieces") {
  const std::string ok = "HTTP/1.1 200 OK\r\n";
  for (const std::string& reply :
       {std::string("HTTP/1.\r\n\r\n"), std::string("HTTP/1.1\r\n\r\n"), std::string("\r\n\r\n"),
        std::string("\0\1\2\3\4\5\6\7", 8), ok + "Server\r\n\r\n",
        ok + "Content-Length: -1\r\n\r\n", ok + "Content-Length: 4\r\n\r\n<net",
        ok + "Transfer-Encoding: chunked\r\n\r\n5\r\n", ok + "X: " + std::string(100000, 'y'),
        ok + "\r\n" + std::string(100000, 'x'), std::string("HTTP/1.1 404 Not Found\r\n\r\n")})
    for (const std::size_t piece : {std::size_t{1}, std::size_t{100}, reply.size()}) {
      INFO(reply.substr(0, 60) << " in pieces of " << piece);
      PagedBench bench;
      bench.answer(reply, piece);
      CHECK(bench.fault().where.find(rdt::settings_path) == 0);
      CHECK(to_string(bench.fault()).find_first_of("\r\n") == std::string::npos);
    }
}

TEST_CASE("a settings page that ends early, or never comes, is a fault of the device") {
  PagedBench shorter, silent;
  shorter.answer("HTTP/1.1 200 OK\r\nContent-Length: 5000\r\n\r\n" + minimal);
  shorter.http().break_off();
  CHECK(shorter.fault_code() == Errc::io);
  silent.answer("HTTP/1.1 200 OK\r\nContent-Length: 5000\r\n\r\n" + minimal);
  silent.host.loop_.run_for(2);
  CHECK(silent.fault_code() == Errc::timeout);
}

}  // namespace netft_pages_test
