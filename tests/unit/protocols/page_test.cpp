// Pages of the Net F/T box. The minimal page is the one that netft-cpp accepted (device-facts.md,
// Net F/T pages).

#include "protocols/rdt/page.hpp"

#include <catch2/catch.hpp>

namespace page_test {

using namespace weft;
using namespace weft::protocols::rdt;

namespace {

const std::string minimal =
    "<netft><prodname>Net F/T</prodname><cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt>"
    "<scfgfu>N</scfgfu><scfgtu>Nm</scfgtu></netft>";

}  // namespace

TEST_CASE("the documented minimal page is read") {
  const auto page = decode_settings(minimal);
  REQUIRE(page);
  CHECK(page->product == "Net F/T");
  CHECK(page->counts_per_force == 1e6);
  CHECK(page->torque_unit == "Nm");
  CHECK(page->rdt_enabled);
}

TEST_CASE("a page that is written is read back, and has whole numbers without an exponent") {
  SettingsPage page;
  page.counts_per_force = 1e6;
  page.counts_per_torque = 123456.5;
  page.rdt_rate_hz = 7000;
  page.rdt_enabled = false;
  const std::string text = encode(page);
  CHECK(text.find("<cfgcpf>1000000</cfgcpf>") != std::string::npos);
  CHECK(text.find("e+") == std::string::npos);
  const auto read = decode_settings(text);
  REQUIRE(read);
  CHECK(read->counts_per_torque == 123456.5);
  CHECK(read->rdt_rate_hz == 7000);
  CHECK_FALSE(read->rdt_enabled);
  const auto calibration = decode_calibration(encode(CalibrationPage{"FT12288", 1e6, 1e6}));
  REQUIRE(calibration);
  CHECK(calibration->serial == "FT12288");
}

TEST_CASE("pages with a tag missing, twice, or without a usable number are refused with its name") {
  for (const auto& [from, to] : {std::pair{"<cfgcpf>1000000</cfgcpf>", ""},
                                 {"<cfgcpf>1000000", "<cfgcpf>nan"},
                                 {"<cfgcpf>1000000", "<cfgcpf>-1"},
                                 {"<cfgcpf>1000000", "<cfgcpf>1e999"},
                                 {"<cfgcpf>1000000", "<cfgcpf>12x"},
                                 {"<cfgcpf>", "<cfgcpf>1</cfgcpf><cfgcpf>"}}) {
    std::string text = minimal;
    text.replace(text.find(from), std::string(from).size(), to);
    const auto page = decode_settings(text);
    REQUIRE_FALSE(page);
    CHECK(page.error().where == "cfgcpf");
  }
  CHECK_FALSE(decode_settings(minimal + std::string(largest_page, ' ')));
  for (std::size_t size = 0; size + 9 < minimal.size(); ++size)
    CHECK_FALSE(decode_settings(std::string_view(minimal).substr(0, size)));
}

TEST_CASE("a page without its product, calibration or rate is read all the same") {
  std::string text = minimal;
  text.erase(text.find("<prodname>"), std::string("<prodname>Net F/T</prodname>").size());
  const auto page = decode_settings(text);
  REQUIRE(page);
  CHECK(page->product.empty());
  CHECK(page->calibration_serial.empty());
  CHECK(page->rdt_rate_hz == 0);
  CHECK(decode_settings("<netft><cfgcalsn> FT12288 </cfgcalsn>" + text)->calibration_serial ==
        "FT12288");
  const auto calibration = decode_calibration("<x><calsn>FT1</calsn></x>");
  REQUIRE(calibration);
  CHECK(calibration->serial == "FT1");
  CHECK_FALSE(decode_calibration("<x><calcpf>1000000</calcpf></x>"));
}

TEST_CASE("both spellings of the torque unit are read; a box writes Nm by default") {
  for (const auto& [text, value] :
       {std::pair{"Nm", 1.0}, {"N-m", 1.0}, {"Nmm", 1e-3}, {"N-mm", 1e-3}})
    CHECK(newton_metres_per(text).value() == value);
  CHECK(encode(SettingsPage{}).find("<scfgtu>Nm</scfgtu>") != std::string::npos);
  CHECK(encode(CalibrationPage{"FT1"}).find("<scaltu>Nm</scaltu>") != std::string::npos);
}

TEST_CASE("misplaced text of a page stays one printable line of an error") {
  std::string text = minimal;
  const std::string from = "<cfgcpf>1000000";
  text.replace(text.find(from), from.size(), "<cfgcpf>5 \x01\x02\r\nServer: x");
  const auto page = decode_settings(text);
  REQUIRE_FALSE(page);
  CHECK(page.error().got == "5 ??");
}

TEST_CASE("units of the pages are turned into SI, unknown ones are refused") {
  CHECK(newtons_per("lbf").value() == Approx(4.448222));
  CHECK(newton_metres_per("N-mm").value() == 1e-3);
  CHECK_FALSE(newtons_per("stone"));
}

}  // namespace page_test
