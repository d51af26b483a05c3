// The web pages of the Net F/T box: the settings of its forms, and their display.

#include <cmath>

#include "sim/devices/rdt_emulator.hpp"
#include "tests/unit/sim/netft_box.hpp"

namespace netft_page_test {

using namespace weft;
using namespace weft::sim;
using test::Box;
using test::start;

namespace {

/// A browser at the box's HTTP port.
struct Browser {
  Box& box;

  std::string query(const std::string& text) {
    NetftPageEmulator page([&] { return &box.box; });
    std::string reply;
    ByteSink sink = [&](ByteView bytes) { reply.append(bytes.begin(), bytes.end()); };
    page.receive(ByteView(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()), box.now,
                 sink);
    return reply;
  }
  std::string get(const std::string& path) {
    return query("GET " + path + " HTTP/1.1\r\nHost: box\r\n\r\n");
  }
  bool shows(const std::string& element, const std::string& page = "/netftapi2.xml") {
    return get(page).find(element) != std::string::npos;
  }
};

}  // namespace

TEST_CASE("the box's web pages set what they show") {
  RdtEmulatorParams params;
  params.torque_unit = "N-m";
  params.calibration_serial = "FT12345";
  Box box(params);
  Browser browser{box};
  const auto query = [&](const std::string& text) { return browser.query(text); };
  const auto get = [&](const std::string& path) { return browser.get(path); };
  const auto shows = [&](const std::string& element) { return browser.shows(element); };
  CHECK(shows("<scfgtu>N-m</scfgtu>"));
  CHECK(shows("<cfgcalsn>FT12345</cfgcalsn>"));
  CHECK(shows("<setuserfilter>0</setuserfilter>"));
  get("/setting.cgi?setuserfilter=4");
  CHECK(shows("<setuserfilter>4</setuserfilter>"));
  get("/setting.cgi?setuserfilter=99");
  CHECK(shows("<setuserfilter>4</setuserfilter>"));

  box.send("12 34 00 42 00 00 00 00");
  CHECK_FALSE(shows("<setbias>0;0;0;0;0;0</setbias>"));
  for (const char* each : {"0", "1", "2", "3", "4"})
    get("/setting.cgi?setbias" + std::string(each) + "=0");
  CHECK(shows("<setbias>0;0;0;0;0;"));
  CHECK_FALSE(shows("<setbias>0;0;0;0;0;0</setbias>"));
  get("/setting.cgi?setbias5=0");
  CHECK(shows("<setbias>0;0;0;0;0;0</setbias>"));
  get("/setting.cgi?setbias0=-7000&setbias2=3000000");
  CHECK(shows("<setbias>-7000;0;3000000;0;0;0</setbias>"));
  const auto biased = box.box.page(box.now).counts;
  CHECK(std::abs(biased[2]) < 0.1e6);  // the plate weighs 2.9 N

  get("/comm.cgi?comrdtrate=250&comrdtbsiz=4");
  CHECK(shows("<comrdtrate>250</comrdtrate>"));
  CHECK(shows("<comrdtbsiz>4</comrdtbsiz>"));
  box.send("12 34 00 03 00 00 00 08");
  box.run(1);
  CHECK(box.datagrams.size() == 2);
  CHECK(box.take().size() == 8);
  get("/comm.cgi?comrdtrate=300");  // every 23rd of 7000 conversions
  CHECK(shows("<comrdtrate>304</comrdtrate>"));
  box.send(start);
  box.run(1);
  const auto records = box.take();
  CHECK(records.size() == 305);
  const auto conversions = static_cast<int>(records[304].ft_sequence - records[0].ft_sequence);
  CHECK(std::abs(conversions - 304 * 23) <= 1);
  get("/comm.cgi?comrdtrate=7000");  // for the next stream
  box.run(0.1);
  CHECK(box.take().size() < 35);
  box.send("12 34 00 00 00 00 00 00");
  get("/comm.cgi?comrdte=0");
  CHECK(shows("<comrdte>Disabled</comrdte>"));
  box.send(start);
  box.run(1);
  CHECK(box.take().empty());

  const std::string whole = get("/"), head = query("HEAD / HTTP/1.1\r\n\r\n");
  CHECK(head == whole.substr(0, whole.find("\r\n\r\n") + 4));
  CHECK(query("GET / HTTP/1.0\n\n").starts_with("HTTP/1.0 200"));
  CHECK(query("\r\nGET / HTTP/1.1\r\n\r\n").starts_with("HTTP/1.0 200"));
}

TEST_CASE("a box has sixteen configurations, of which the active one counts") {
  RdtEmulatorParams params;
  params.sensor.noise = {};
  params.sensor.quantum = {};
  Box box(params);
  Browser browser{box};
  CHECK(browser.shows("<scfgtu>Nm</scfgtu>"));
  CHECK(browser.shows("<scaltu>Nm</scaltu>", "/netftcalapi.xml"));
  CHECK(browser.shows("<calmr>40;40;120;2;2;2</calmr>", "/netftcalapi.xml"));
  const auto down = box.box.page(box.now).counts;
  browser.get("/config.cgi?cfgid=3&cfgnam=a%3Cb+c&cfgfu=1&cfgtu=4&cfgtfx0=100&cfgtfx3=90&cfgtdu=3");
  CHECK_FALSE(browser.shows("<cfgfu>1</cfgfu>"));
  const std::string third = "/netftapi2.xml?index=3";
  CHECK(browser.shows("<cfgnam>a&lt;b c</cfgnam>", third));
  CHECK(browser.shows("<cfgtfx>100;0;0;90;0;0</cfgtfx>", third));
  CHECK(browser.shows("<scfgfu>lbf</scfgfu>", third));
  CHECK(browser.shows("<scfgtu>Nmm</scfgtu>", third));
  CHECK(browser.shows("<cfgcpt>1000</cfgcpt>", third));
  CHECK(browser.shows("<cfgcpf>4448222</cfgcpf>", third));
  CHECK(box.box.page(box.now, 3).max_ratings[2] == Approx(26.977));  // 120 N in lbf
  CHECK(box.box.page(box.now).counts == down);
  browser.get("/setting.cgi?setcfgsel=3");
  CHECK(browser.shows("<setcfgsel>3</setcfgsel>"));
  CHECK(box.box.page(box.now).counts[1] == Approx(down[2]));  // a quarter turn about x
  for (const char* refused : {"cfgid=16&cfgfu=2", "cfgfu=2", "cfgid=3&cfgfu=7", "cfgid=3&cfgfu=x",
                              "cfgid=3&cfgfu=2.5", "cfgid=3&cfgfu=3"})  // klbf: 4.4e9 counts
    browser.get("/config.cgi?" + std::string(refused));
  CHECK(browser.shows("<cfgfu>1</cfgfu>"));
  for (const char* nothing : {"/nothing.cgi?x=1", "/nothing.htm", "/comm", "/comm.cgi.htm"})
    CHECK(browser.get(nothing).starts_with("HTTP/1.0 404"));
  browser.get("/config.cgi?cfgid=3&cfgusra=a%00%FF%zz%3&cfgnam=" + std::string(40, 'n'));
  CHECK(browser.shows("<cfgusra>a??%zz%3</cfgusra>"));
  CHECK(browser.shows("<cfgnam>" + std::string(32, 'n') + "</cfgnam>"));
}

TEST_CASE("a form of the box sends on to a page, and the snapshot's sets the zero") {
  RdtEmulatorParams params;
  params.sensor.noise = {};
  Box box(params);
  Browser browser{box};
  for (const char* form : {"/comm", "/setting", "/config", "/moncon", "/rundata"}) {
    const std::string page = std::string(form) + ".htm";
    const std::string reply = browser.get(std::string(form) + ".cgi?x=1");
    CHECK(reply.starts_with("HTTP/1.0 302 Found\r\nLocation: " + page + "\r\n"));
    CHECK(browser.get(page).starts_with("HTTP/1.0 200"));
  }
  const std::int32_t weight = box.box.page(box.now).counts[2];
  REQUIRE(weight > 2'000'000);
  for (const char* zero : {"bias", "setuserbias"}) {
    browser.get("/rundata.cgi?cmd=" + std::string(zero));
    CHECK(box.box.page(box.now).counts[2] == 0);
    browser.get("/rundata.cgi?cmd=clearuserbias");
    CHECK(box.box.page(box.now).counts[2] == weight);
  }
}

TEST_CASE("numbers of a form may be escaped, whole ones hexadecimal") {
  Box box;
  Browser browser{box};
  browser.get("/config.cgi?cfgid=%33&cfgtfx0=%2D1.25");
  CHECK(browser.shows("<cfgtfx>-1.25;0;0;0;0;0</cfgtfx>", "/netftapi2.xml?index=3"));
  browser.get("/moncon.cgi?mco0=0x0F&mco1=0x&mco2=0xG&mco3=0x1FF");
  CHECK(browser.shows("<mco>0x0F;0x00;0x00;0x00;"));
}

TEST_CASE("the box's page sets thresholds, and shows which were breached, and the peaks") {
  RdtEmulatorParams params;
  params.sensor.noise = {};
  Box box(params);
  Browser browser{box};
  CHECK(browser.shows("<mcx>-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1</mcx>"));
  // the plate weighs 2.9 N
  browser.get("/moncon.cgi?mce0=1&mcx0=2&mcc0=1&mcv0=2000000&mco0=5");
  browser.get("/moncon.cgi?mce1=1&mcx1=2&mcc1=-1&mcv1=2000000&mco1=8");
  browser.get("/moncon.cgi?mce2=0&mcx2=2&mcc2=1&mcv2=2000000&mco2=16");
  CHECK(browser.shows("<mcv>2000000;2000000;2000000;0;"));
  CHECK(browser.shows("<runmcl>0</runmcl>"));
  for (const char* refused :
       {"mcc0=0.5", "mcc0=0", "mcx0=-0.5", "mce0=0.2", "mcv0=12abc", "setmce=1e-300"})
    browser.get("/moncon.cgi?" + std::string(refused));
  CHECK(browser.shows("<mcc>1;-1;1;1;"));
  CHECK(browser.shows("<mcx>2;2;2;-1;"));
  CHECK(browser.shows("<mcv>2000000;2000000;2000000;0;"));
  CHECK(browser.shows("<runmcl>0</runmcl>"));
  browser.get("/moncon.cgi?setmce=1");
  CHECK(browser.shows("<runstat>0x80010000</runstat>"));
  CHECK(browser.shows("<runmcb>0x00000001</runmcb>"));
  CHECK(browser.shows("<runmco>0x05</runmco>"));
  CHECK(browser.shows("<runmcl>1</runmcl>"));
  browser.get("/moncon.cgi?setmce=0");
  box.send("12 34 00 41 00 00 00 00");
  CHECK(browser.shows("<runmcl>0</runmcl>"));
  CHECK(browser.shows("<runpkmx>0;0;0;0;0;0</runpkmx>"));
  browser.get("/setting.cgi?setpke=1");
  const auto counts = box.box.page(box.now).counts;
  CHECK(counts[2] > 2'900'000);
  CHECK(box.box.page(box.now).lowest_counts == counts);
  box.send("12 34 00 42 00 00 00 00");
  CHECK(box.box.page(box.now).lowest_counts[2] == 0);
  CHECK(box.box.page(box.now).highest_counts == counts);
  browser.get("/setting.cgi?setpke=0");
  browser.get("/setting.cgi?setpke=1");  // starts again
  CHECK(box.box.page(box.now).highest_counts[2] == 0);
}

}  // namespace netft_page_test
