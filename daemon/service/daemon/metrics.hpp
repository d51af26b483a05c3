#pragma once
// The body of GET /metrics: values that the server's thread knows without waiting, as OpenMetrics
// or as the older text format of Prometheus. Source: OpenMetrics 1.0
// (https://github.com/OpenObservability/OpenMetrics); names as in
// https://prometheus.io/docs/practices/naming.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/service/methods/services.hpp"
#include "daemon/service/notify/notifier.hpp"
#include "daemon/service/rpc/session.hpp"

namespace weft::daemon::server {

enum class MetricType { counter, gauge };

/// Builds the text of the metrics, family by family.
class Exposition {
 public:
  using Labels = std::vector<std::pair<std::string_view, std::string>>;
  explicit Exposition(bool is_open_metrics) : is_open_metrics_(is_open_metrics) {}

  /// Starts a family; the following samples belong to it. A counter's name ends with _total.
  void family(std::string_view name, MetricType type, std::string_view help);
  void sample(double value, const Labels& labels = {});
  /// One sample per name with the label "state": 1 for `current` and 0 for the others.
  template <class Names>
  void states(const Names& names, std::string_view current) {
    for (const auto& name : names) sample(name == current ? 1 : 0, {{"state", std::string(name)}});
  }
  /// Includes the end mark.
  [[nodiscard]] std::string text() const { return text_ + "# EOF\n"; }

 private:
  bool is_open_metrics_;
  std::string name_, text_;
};

/// All members must outlive the call.
struct MetricsSources {
  const api::Services& services;
  const Shared& shared;
  const notify::Notifier& notifier;
};
std::string metrics_text(const MetricsSources& sources, bool is_open_metrics);

}  // namespace weft::daemon::server
