#include "sim/devices/netft_settings.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

namespace weft::sim {

namespace {

namespace rdt = protocols::rdt;

constexpr std::size_t longest_name = 32;

/// A number of a query; nothing when it is absent or outside of what the box takes.
std::optional<double> number_in(std::string_view query, const std::string& key, double least,
                                double most) {
  const auto text = rdt::query_value(query, key);
  double value = 0;
  if (!text || std::from_chars(text->data(), text->data() + text->size(), value).ec != std::errc{})
    return std::nullopt;
  return value >= least && value <= most ? std::optional(value) : std::nullopt;
}

template <class Number>
void take(Number& value, std::string_view query, const std::string& key, double least,
          double most) {
  if (const auto given = number_in(query, key, least, most)) value = static_cast<Number>(*given);
}

/// "%20" and "+" of a query as what they stand for.
std::string plain(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned code = 0;
    const char* const digits = text.data() + i + 1;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2) {
      out += static_cast<char>(code);
      i += 2;
    } else {
      out += text[i] == '+' ? ' ' : text[i];
    }
  }
  return out;
}

void take(std::string& name, std::string_view query, const std::string& key) {
  if (const auto given = rdt::query_value(query, key)) name = plain(*given).substr(0, longest_name);
}

}  // namespace

void take_communication(NetftSettings& settings, std::string_view query) {
  if (const auto rate_hz = number_in(query, "comrdtrate", 1, conversions_hz))
    settings.rate_hz = conversions_hz / std::floor(conversions_hz / *rate_hz);
  take(settings.records_per_datagram, query, "comrdtbsiz", 1, rdt::max_records_per_datagram);
  take(settings.rdt_enabled, query, "comrdte", 0, 1);
  take(settings.multi_unit, query, "comrdtmsyn", 0, 1);
  take(settings.ethernet_ip, query, "comeipe", 0, 1);
}

void take_settings(NetftSettings& settings, std::string_view query) {
  take(settings.user_filter, query, "setuserfilter", 0, 12);
  take(settings.peak_logging, query, "setpke", 0, 1);
  take(settings.active, query, "setcfgsel", 0, rdt::configurations - 1);
  using Limits = std::numeric_limits<std::int32_t>;
  for (std::size_t i = 0; i < settings.bias_counts.size(); ++i)
    take(settings.bias_counts[i], query, "setbias" + std::to_string(i), Limits::min(),
         Limits::max());
}

void take_configuration(NetftSettings& settings, std::string_view query) {
  const auto id = number_in(query, "cfgid", 0, rdt::configurations - 1);
  if (!id) return;
  rdt::Configuration& own = settings.configuration[static_cast<std::size_t>(*id)];
  constexpr double longest = 1e4, widest = 360;
  take(own.name, query, "cfgnam");
  take(own.calibration, query, "cfgcalsel", 0, rdt::configurations - 1);
  take(own.force_unit, query, "cfgfu", 1, 6);
  take(own.torque_unit, query, "cfgtu", 1, 6);
  take(own.distance_unit, query, "cfgtdu", 1, 5);
  take(own.angle_unit, query, "cfgtau", 1, 2);
  for (std::size_t i = 0; i < own.tool_transform.size(); ++i) {
    const double most = i < 3 ? longest : widest;
    take(own.tool_transform[i], query, "cfgtfx" + std::to_string(i), -most, most);
  }
  take(own.user_a, query, "cfgusra");
  take(own.user_b, query, "cfgusrb");
}

void take_thresholds(NetftSettings& settings, std::string_view query) {
  take(settings.thresholds_enabled, query, "setmce", 0, 1);
  using Limits = std::numeric_limits<std::int32_t>;
  for (std::size_t i = 0; i < settings.threshold.size(); ++i) {
    rdt::Threshold& own = settings.threshold[i];
    const std::string n = std::to_string(i);
    take(own.enabled, query, "mce" + n, 0, 1);
    take(own.axis, query, "mcx" + n, -1, 5);
    if (const auto sign = number_in(query, "mcc" + n, -1, 1); sign && *sign != 0)
      own.comparison = static_cast<int>(*sign);
    take(own.counts, query, "mcv" + n, Limits::min(), Limits::max());
    take(own.output_code, query, "mco" + n, 0, 255);
  }
}

}  // namespace weft::sim
