#include "protocols/rdt/page.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <span>
#include <utility>

#include "protocols/base/printable.hpp"

namespace weft::protocols::rdt {
namespace {

/// No exponent: clients parse counts as integers.
std::string number(double value) {
  std::array<char, 400> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed).ptr;
  return {text.data(), end};
}

template <class List>
std::string list(const List& values) {
  std::string text;
  for (const auto value : values)
    text += (text.empty() ? "" : ";") + number(static_cast<double>(value));
  return text;
}

std::string tag(std::string_view name, std::string_view text) {
  const std::string n(name);
  return "<" + n + ">" + std::string(text) + "</" + n + ">\n";
}

std::string hexadecimal(std::uint32_t value, int digits) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "0x%0*X", digits, value);
  return text.data();
}

/// Escapes text that a person typed, so that it does not close an element.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') out += "&amp;";
    if (c == '<') out += "&lt;";
    if (c == '>') out += "&gt;";
    if (c != '&' && c != '<' && c != '>') out += c;
  }
  return out;
}

const char* switched(bool on) {
  return on ? "Enabled" : "Disabled";
}

const char* digit(bool on) {
  return on ? "1" : "0";
}

std::string_view name_of(std::span<const std::string_view> names, unsigned code) {
  return code >= 1 && code <= names.size() ? names[code - 1] : std::string_view();
}

constexpr std::array<std::string_view, 6> force_units{"lbf", "N", "klbf", "kN", "kgf", "gf"};
constexpr std::array<std::string_view, 6> torque_units{"lbf-in", "lbf-ft", "Nm",
                                                       "Nmm",    "kgf-cm", "kNm"};
constexpr std::array<std::string_view, 5> distance_units{"in", "ft", "mm", "cm", "m"};
constexpr std::array<std::string_view, 2> angle_units{"degrees", "radians"};

/// The text of the only element of this name.
Result<std::string> only(std::string_view xml, const std::string& name) {
  const std::string open = "<" + name + ">", close = "</" + name + ">";
  const std::size_t begin = xml.find(open);
  const std::size_t end = begin == std::string_view::npos ? begin : xml.find(close, begin);
  if (end == std::string_view::npos || xml.find(open, end) != std::string_view::npos)
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "element of the Net F/T page missing or not unique",
                 .expected = "one element of this name",
                 .got = end == std::string_view::npos ? "none" : "several"});
  std::string_view text = xml.substr(begin + open.size(), end - begin - open.size());
  while (!text.empty() && text.front() <= ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() <= ' ') text.remove_suffix(1);
  return std::string(text);
}

Result<double> positive(std::string_view xml, const std::string& name) {
  const auto text = only(xml, name);
  if (!text) return pass(text.error());
  double value = 0;
  const auto read = std::from_chars(text->data(), text->data() + text->size(), value);
  if (read.ec == std::errc{} && read.ptr == text->data() + text->size() && std::isfinite(value) &&
      value > 0)
    return value;
  return fail({.code = Errc::parse,
               .where = name,
               .what = "number on the Net F/T page invalid",
               .expected = "a number above zero",
               .got = printable(*text)});
}

Status fits(std::string_view xml) {
  if (xml.size() <= largest_page) return {};
  return fail({.code = Errc::parse,
               .what = "Net F/T page too large",
               .expected = "at most " + std::to_string(largest_page) + " bytes",
               .got = std::to_string(xml.size()) + " bytes"});
}

using Unit = std::pair<std::string_view, double>;

template <std::size_t size>
Result<double> factor(const std::array<Unit, size>& units, std::string_view name) {
  std::string known;
  for (const auto& [unit, value] : units) {
    if (unit == name) return value;
    known += (known.empty() ? "" : ", ") + std::string(unit);
  }
  return fail({.code = Errc::unsupported,
               .what = "unit unknown",
               .expected = known,
               .got = printable(name)});
}

constexpr std::string_view prologue = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";

std::string present_state(const SettingsPage& page) {
  return tag("runstat", hexadecimal(page.status, 8)) + tag("runft", list(page.counts)) +
         tag("runpkmx", list(page.highest_counts)) + tag("runpkmn", list(page.lowest_counts)) +
         tag("runmcb", hexadecimal(page.breached, 8)) +
         tag("runmco", hexadecimal(page.output_code, 2)) + tag("runmcl", digit(page.latched)) +
         tag("runrate", "7000");
}

std::string settings(const SettingsPage& page) {
  return tag("setbias", list(page.bias_counts)) +
         tag("setuserfilter", std::to_string(page.user_filter)) +
         tag("setcfgsel", std::to_string(page.active_configuration)) +
         tag("setpke", digit(page.peak_logging)) + tag("setmce", digit(page.thresholds_enabled));
}

std::string configuration(const SettingsPage& page) {
  const Configuration& own = page.configuration;
  return tag("cfgnam", escaped(own.name)) + tag("cfgcalsel", std::to_string(own.calibration)) +
         tag("cfgcalsn", page.calibration_serial) + tag("cfgfu", std::to_string(own.force_unit)) +
         tag("scfgfu", page.force_unit) + tag("cfgtu", std::to_string(own.torque_unit)) +
         tag("scfgtu", page.torque_unit) + tag("cfgcpf", number(page.counts_per_force)) +
         tag("cfgcpt", number(page.counts_per_torque)) + tag("cfgmr", list(page.max_ratings)) +
         tag("cfgtdu", std::to_string(own.distance_unit)) +
         tag("scfgtdu", name_of(distance_units, own.distance_unit)) +
         tag("cfgtau", std::to_string(own.angle_unit)) +
         tag("scfgtau", name_of(angle_units, own.angle_unit)) +
         tag("cfgtfx", list(own.tool_transform)) + tag("cfgusra", escaped(own.user_a)) +
         tag("cfgusrb", escaped(own.user_b));
}

std::string threshold_statements(const SettingsPage& page) {
  std::array<std::string, 5> lists;  // enabled, axis, comparison, value, output
  for (const Threshold& each : page.threshold) {
    const std::array<std::string, 5> texts{
        digit(each.enabled), std::to_string(each.axis), std::to_string(each.comparison),
        std::to_string(each.counts), hexadecimal(each.output_code, 2)};
    for (std::size_t i = 0; i < lists.size(); ++i)
      lists[i] += (lists[i].empty() ? "" : ";") + texts[i];
  }
  return tag("mce", lists[0]) + tag("mcx", lists[1]) + tag("mcc", lists[2]) + tag("mcv", lists[3]) +
         tag("mco", lists[4]);
}

std::string communication(const SettingsPage& page) {
  return tag("comrdte", switched(page.rdt_enabled)) +
         tag("comrdtrate", std::to_string(std::lround(page.rdt_rate_hz))) +
         tag("comrdtbsiz", std::to_string(page.buffer_size)) +
         tag("comrdtmsyn", switched(page.multi_unit)) + tag("comeipe", switched(page.ethernet_ip)) +
         tag("comnetip", "192.168.1.1") + tag("comnetmsk", "255.255.255.0") +
         tag("comnetgw", "0.0.0.0") + tag("comnetdhcp", "Disabled") + tag("netip", "192.168.1.1") +
         tag("nethwaddr", "00:16:BD:00:00:00");
}

}  // namespace

std::string encode(const SettingsPage& page) {
  return std::string(prologue) + "<netft>\n" + tag("prodname", page.product) + present_state(page) +
         settings(page) + configuration(page) + threshold_statements(page) + communication(page) +
         tag("mfgdigsn", page.calibration_serial) + tag("mfgdigver", "2.2.59") + "</netft>\n";
}

std::string encode(const CalibrationPage& page) {
  return std::string(prologue) + "<netftCalibration>\n" + tag("calsn", page.serial) +
         tag("calpn", page.part_number) + tag("caldt", page.date) + tag("calfu", "2") +
         tag("scalfu", page.force_unit) + tag("caltu", "3") + tag("scaltu", page.torque_unit) +
         tag("calmr", list(page.max_ratings)) + tag("calcpf", number(page.counts_per_force)) +
         tag("calcpt", number(page.counts_per_torque)) + "</netftCalibration>\n";
}

std::string_view force_unit_name(unsigned code) {
  return name_of(force_units, code);
}

std::string_view torque_unit_name(unsigned code) {
  return name_of(torque_units, code);
}

Result<SettingsPage> decode_settings(std::string_view xml) {
  if (Status size = fits(xml); !size) return pass(size.error());
  SettingsPage page;
  for (auto [name, member] :
       {std::pair{"scfgfu", &page.force_unit}, {"scfgtu", &page.torque_unit}}) {
    auto text = only(xml, name);
    if (!text) return pass(text.error());
    *member = std::move(*text);
  }
  page.product = only(xml, "prodname").value_or("");
  page.calibration_serial = only(xml, "cfgcalsn").value_or("");
  const auto force = positive(xml, "cfgcpf");
  if (!force) return pass(force.error());
  const auto torque = positive(xml, "cfgcpt");
  if (!torque) return pass(torque.error());
  page.counts_per_force = *force;
  page.counts_per_torque = *torque;
  if (const auto enabled = only(xml, "comrdte")) page.rdt_enabled = *enabled == "Enabled";
  if (const auto rate = positive(xml, "comrdtrate")) page.rdt_rate_hz = *rate;
  return page;
}

Result<CalibrationPage> decode_calibration(std::string_view xml) {
  if (Status size = fits(xml); !size) return pass(size.error());
  auto serial = only(xml, "calsn");
  if (!serial) return pass(serial.error());
  CalibrationPage page{std::move(*serial)};
  if (const auto force = positive(xml, "calcpf")) page.counts_per_force = *force;
  if (const auto torque = positive(xml, "calcpt")) page.counts_per_torque = *torque;
  return page;
}

Result<double> newtons_per(std::string_view force_unit) {
  static constexpr std::array<Unit, 6> units{{{"N", 1},
                                              {"kN", 1000},
                                              {"lbf", 4.4482216152605},
                                              {"klbf", 4448.2216152605},
                                              {"kgf", 9.80665},
                                              {"gf", 9.80665e-3}}};
  return factor(units, force_unit);
}

Result<double> newton_metres_per(std::string_view torque_unit) {
  static constexpr std::array<Unit, 11> units{{{"Nm", 1},
                                               {"N-m", 1},
                                               {"Nmm", 1e-3},
                                               {"N-mm", 1e-3},
                                               {"kNm", 1000},
                                               {"kN-m", 1000},
                                               {"lbf-in", 0.1129848290276167},
                                               {"lbfin", 0.1129848290276167},
                                               {"lbf-ft", 1.3558179483314004},
                                               {"lbfft", 1.3558179483314004},
                                               {"kgf-cm", 0.0980665}}};
  return factor(units, torque_unit);
}

}  // namespace weft::protocols::rdt
