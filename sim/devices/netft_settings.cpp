#include "sim/devices/netft_settings.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>

#include "protocols/rdt/rdt.hpp"
#include "protocols/rdt/tcp_command.hpp"

namespace weft::sim {
namespace {

namespace rdt = protocols::rdt;

constexpr std::size_t longest_name = 32, longest_user_field = 16;

/// "%20" and "+" of a query as what they stand for; what a page cannot hold is a "?".
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
  const auto unprintable = [](char c) { return c < ' ' || c > '~'; };
  std::replace_if(out.begin(), out.end(), unprintable, '?');
  return out;
}

template <class Number>
std::from_chars_result read_number(const std::string& text, Number& value) {
  const char* const end = text.data() + text.size();
  if constexpr (std::is_integral_v<Number>)
    if (text.starts_with("0x"))  // as the page shows output codes
      return std::from_chars(text.data() + 2, end, value, 16);
  return std::from_chars(text.data(), end, value);
}

/// A number of a query; nothing when it is absent, no such number or outside of what the box takes.
template <class Number>
std::optional<Number> number_in(std::string_view query, const std::string& key, Number least,
                                Number most) {
  const auto given = rdt::query_value(query, key);
  if (!given) return std::nullopt;
  const std::string text = plain(*given);
  Number value = 0;
  const auto read = read_number(text, value);
  if (read.ec != std::errc{} || read.ptr != text.data() + text.size() ||
      !(value >= least && value <= most))
    return std::nullopt;
  return value;
}

/// A whole number that is switch, code, count or index.
template <class Whole>
void take(Whole& value, std::string_view query, const std::string& key, std::int64_t least,
          std::int64_t most) {
  if (const auto given = number_in(query, key, least, most)) value = static_cast<Whole>(*given);
}

void take(std::string& text, std::string_view query, const std::string& key, std::size_t longest) {
  if (const auto given = rdt::query_value(query, key)) text = plain(*given).substr(0, longest);
}

}  // namespace

void apply_communication(NetftSettings& settings, std::string_view query) {
  if (const auto rate_hz = number_in(query, "comrdtrate", 1.0, conversions_hz))
    settings.rate_hz = conversions_hz / std::floor(conversions_hz / *rate_hz);
  take(settings.records_per_datagram, query, "comrdtbsiz", 1, rdt::max_records_per_datagram);
  take(settings.rdt_enabled, query, "comrdte", 0, 1);
  take(settings.multi_unit, query, "comrdtmsyn", 0, 1);
  take(settings.ethernet_ip, query, "comeipe", 0, 1);
}

void apply_settings(NetftSettings& settings, std::string_view query) {
  take(settings.user_filter, query, "setuserfilter", 0, 12);
  take(settings.peak_logging, query, "setpke", 0, 1);
  take(settings.active, query, "setcfgsel", 0, rdt::configurations - 1);
  using Limits = std::numeric_limits<std::int32_t>;
  for (std::size_t i = 0; i < settings.bias_counts.size(); ++i)
    take(settings.bias_counts[i], query, "setbias" + std::to_string(i), Limits::min(),
         Limits::max());
}

void apply_configuration(NetftSettings& settings, std::string_view query) {
  const auto id = number_in<std::size_t>(query, "cfgid", 0, rdt::configurations - 1);
  if (!id) return;
  rdt::Configuration& own = settings.configuration[*id];
  constexpr double longest = 1e4, widest = 360;
  take(own.name, query, "cfgnam", longest_name);
  take(own.calibration, query, "cfgcalsel", 0, rdt::configurations - 1);
  take(own.force_unit, query, "cfgfu", 1, 6);
  take(own.torque_unit, query, "cfgtu", 1, 6);
  take(own.distance_unit, query, "cfgtdu", 1, 5);
  take(own.angle_unit, query, "cfgtau", 1, 2);
  for (std::size_t i = 0; i < own.tool_transform.size(); ++i) {
    const double most = i < 3 ? longest : widest;
    if (const auto given = number_in(query, "cfgtfx" + std::to_string(i), -most, most))
      own.tool_transform[i] = *given;
  }
  take(own.user_a, query, "cfgusra", longest_user_field);
  take(own.user_b, query, "cfgusrb", longest_user_field);
}

void apply_thresholds(NetftSettings& settings, std::string_view query) {
  take(settings.thresholds_enabled, query, "setmce", 0, 1);
  using Limits = std::numeric_limits<std::int32_t>;
  for (std::size_t i = 0; i < settings.threshold.size(); ++i) {
    rdt::Threshold& own = settings.threshold[i];
    const std::string n = std::to_string(i);
    take(own.enabled, query, "mce" + n, 0, 1);
    take(own.axis, query, "mcx" + n, -1, 5);
    if (const auto sign = number_in(query, "mcc" + n, -1, 1); sign && *sign != 0)
      own.comparison = *sign;
    take(own.counts, query, "mcv" + n, Limits::min(), Limits::max());
    take(own.output_code, query, "mco" + n, 0, 255);
  }
}

Result<ToolTransform> ToolTransform::create(const protocols::rdt::Configuration& of) {
  const auto metres = protocols::rdt::metres_per(static_cast<std::uint8_t>(of.distance_unit));
  if (!metres) return pass(metres.error());
  const auto radians = protocols::rdt::radians_per(static_cast<std::uint8_t>(of.angle_unit));
  if (!radians) return pass(radians.error());
  ToolTransform made;
  for (std::size_t i = 0; i < 3; ++i) {
    made.offset_m_[i] = of.tool_transform[i] * *metres;
    made.turn_rad_[i] = of.tool_transform[i + 3] * *radians;
  }
  return made;
}

Wrench ToolTransform::apply(const Wrench& sensed) const {
  if (none()) return sensed;
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Eigen::Matrix3d frame =
      (AngleAxisd(turn_rad_[0], Vector3d::UnitX()) * AngleAxisd(turn_rad_[1], Vector3d::UnitY()) *
       AngleAxisd(turn_rad_[2], Vector3d::UnitZ()))
          .toRotationMatrix();
  const Vector3d force(sensed[0], sensed[1], sensed[2]);
  const Vector3d torque(sensed[3], sensed[4], sensed[5]);
  const Vector3d offset(offset_m_[0], offset_m_[1], offset_m_[2]);
  const Vector3d f = frame.transpose() * force;
  const Vector3d t = frame.transpose() * (torque - offset.cross(force));
  return {f.x(), f.y(), f.z(), t.x(), t.y(), t.z()};
}

}  // namespace weft::sim
