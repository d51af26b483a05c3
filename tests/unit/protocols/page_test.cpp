// Pages of the Net F/T box. The minimal page is the one that netft-cpp accepted (device-facts.md,
// Net F/T pages).

#include "protocols/rdt/page.hpp"

#include <catch2/catch.hpp>

namespace page_test {

using namespace weft;
using namespace weft::protocols::rdt;

namespace {

ByteView bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

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

TEST_CASE("units of the pages are turned into SI, unknown ones are refused") {
  CHECK(newtons_per("lbf").value() == Approx(4.448222));
  CHECK(newton_metres_per("N-mm").value() == 1e-3);
  CHECK_FALSE(newtons_per("stone"));
}

TEST_CASE("a reply is put together from any pieces, with and without its length") {
  const std::string with = http_reply(200, "text/xml", minimal);
  const std::string without = "HTTP/1.0 200 OK\r\nServer: x\r\n\r\n" + minimal;
  for (const std::string& text : {with, without})
    for (std::size_t piece = 1; piece < text.size(); piece += 7) {
      HttpReply reply;
      for (std::size_t at = 0; at < text.size(); at += piece) {
        CHECK_FALSE(reply.complete());
        REQUIRE(reply.push(bytes_of(std::string_view(text).substr(at, piece))));
      }
      REQUIRE(reply.complete());
      CHECK(decode_settings(reply.body()));
    }
  // What an old server sends behind its page, in the same piece or in none, is no part of it.
  HttpReply with_more;
  REQUIRE(with_more.push(bytes_of(without + "\r\n")));
  REQUIRE(with_more.complete());
  CHECK(with_more.body() == minimal);
  HttpReply chunked;
  const Status status =
      chunked.push(bytes_of("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n5\r\n"));
  REQUIRE_FALSE(status);
  CHECK(status.error().what == "the reply comes in chunks");
  HttpReply refused;
  CHECK_FALSE(refused.push(bytes_of("HTTP/1.1 404 Not Found\r\n\r\n")));
  HttpReply endless;
  CHECK_FALSE(endless.push(bytes_of(std::string(200000, 'x'))));
}

TEST_CASE("requests are read with their query; what is no GET is refused") {
  const auto request = decode_request_head("GET /comm.cgi?comrdtrate=500 HTTP/1.1\r\nHost: x");
  REQUIRE(request);
  CHECK(request->path == "/comm.cgi");
  CHECK(request->query == "comrdtrate=500");
  CHECK(decode_request_head("GET http://192.168.1.1/a?b=1 HTTP/1.1")->path == "/a");
  CHECK(decode_request_head("GET http://192.168.1.1 HTTP/1.1")->path == "/");
  CHECK(decode_request_head("HEAD / HTTP/1.1")->head_only);
  CHECK_FALSE(request->head_only);
  CHECK(query_value("a=1&bb=2&c=", "bb") == "2");
  CHECK(query_value("a=1&bb=2&c=", "c") == "");
  for (const char* absent : {"b", "d", ""}) CHECK_FALSE(query_value("a=1&bb=2&c=&d", absent));
  for (const char* bad : {"", "GET", "POST / HTTP/1.1", "GET /"})
    CHECK_FALSE(decode_request_head(bad));
}

TEST_CASE("replies are of HTTP/1.0, and say that the connection ends") {
  CHECK(http_reply(200, "text/html", "ab") ==
        "HTTP/1.0 200 OK\r\nContent-Type: text/html\r\nContent-Length: 2\r\n"
        "Connection: close\r\n\r\nab");
  CHECK(http_reply(302, "text/html", "", "/comm.htm")
            .starts_with("HTTP/1.0 302 Found\r\nLocation: /comm.htm\r\n"));
}

}  // namespace page_test
