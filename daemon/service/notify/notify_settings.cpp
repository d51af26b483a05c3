#include "daemon/service/notify/notify_settings.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/text/format.hpp"
#include "protocols/base/closest.hpp"
#include "recipes/schema/object_reader.hpp"

namespace weft::daemon::notify {
namespace {

using nlohmann::json;
using recipes::Need;
using recipes::ObjectReader;
using recipes::Problems;

constexpr std::uintmax_t longest_secret = 4096;  // [bytes]
constexpr const char* secret_hint =
    "secret not allowed in this file; name a file with it in a key that ends in _file";

const json& placeholder_example() {
  static const json example = to_json(Event{});
  return example;
}

bool has_control(std::string_view text) {
  return std::ranges::any_of(text, [](char c) { return static_cast<unsigned char>(c) < ' '; });
}

/// One line that only the daemon's user and group may read, without its line end.
Result<std::string> read_private_text(const std::filesystem::path& file) {
  struct stat found {};
  constexpr unsigned for_others = 027;  // the group may read
  if (stat(file.c_str(), &found) == 0 && (found.st_mode & for_others) != 0)
    return fail({.code = Errc::wrong_state,
                 .where = file.string(),
                 .what = "secret file accessible to other users",
                 .expected = "mode 0600 or 0640",
                 .hint = "Run chmod 600 " + file.string()});
  auto text = read_text_file(file, longest_secret);
  if (!text) return text;
  const std::string_view line = trimmed(*text, " \t\r\n");
  if (line.empty() || has_control(line))
    return fail({.code = Errc::parse,
                 .where = file.string(),
                 .what = "invalid secret file",
                 .expected = "one line with the secret"});
  return std::string(line);
}

/// Calls `on_text` for the text between placeholders and `on_name` for each placeholder's name.
template <class OnText, class OnName>
void for_parts(const std::string& text, const OnText& on_text, const OnName& on_name) {
  static const std::regex placeholder("\\{([a-z_]+)\\}");
  auto at = text.cbegin();
  for (std::sregex_iterator found(text.begin(), text.end(), placeholder), end; found != end;
       ++found) {
    on_text(std::string(at, (*found)[0].first));
    on_name((*found)[1].str());
    at = (*found)[0].second;
  }
  on_text(std::string(at, text.cend()));
}

/// Reads one settings file; collects all problems in one list.
class SettingsReader {
 public:
  SettingsReader(std::filesystem::path folder, Problems& problems)
      : folder_(std::move(folder)), problems_(problems) {}

  NotifySettings read(const json& document, const std::string& bench);
  /// Why the first unusable secret was refused.
  [[nodiscard]] const std::optional<Error>& refused() const { return refused_; }

 private:
  std::vector<EventKind> read_events(ObjectReader& reader);
  WebhookSettings read_webhook(const json& value, const std::string& pointer);
  void read_headers(ObjectReader& reader, WebhookSettings& webhook);
  void check_url(const std::string& place, const WebhookSettings& webhook);
  MqttSettings read_mqtt(const json& value, const std::string& pointer, const std::string& bench);
  std::string read_secret(ObjectReader& reader, std::string_view key);
  std::string read_ca(ObjectReader& reader);
  void check_template(const std::string& place, const json& value);

  std::filesystem::path folder_;
  Problems& problems_;
  std::optional<Error> refused_;
};

NotifySettings SettingsReader::read(const json& document, const std::string& bench) {
  NotifySettings settings;
  ObjectReader reader(document, "", problems_);
  settings.events = read_events(reader);
  const double fallback = static_cast<double>(settings.disk_low_bytes);
  settings.disk_low_bytes =
      static_cast<std::uint64_t>(reader
                                     .quantity({"disk_low", {{"disk_low_gb", 1e-9}}},
                                               {.min = 0, .max = 1e15, .why = {}}, Need::optional)
                                     .value_or(fallback));
  if (const json* const webhook = reader.object("webhook", Need::optional))
    settings.webhook = read_webhook(*webhook, reader.at("webhook"));
  if (const json* const mqtt = reader.object("mqtt", Need::optional))
    settings.mqtt = read_mqtt(*mqtt, reader.at("mqtt"), bench);
  reader.finish();
  if (!reader.has("webhook") && !reader.has("mqtt"))
    problems_.add({"", "channel missing", "webhook or mqtt", "", ""});
  return settings;
}

std::vector<EventKind> SettingsReader::read_events(ObjectReader& reader) {
  const std::vector<std::string_view> known(event_names.begin(), event_names.end());
  json wanted = known;
  if (const json* const list = reader.array("events", Need::optional)) wanted = *list;
  std::vector<EventKind> events;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const std::string name = wanted[i].is_string() ? wanted[i].get<std::string>() : "";
    if (const auto kind = enum_named<EventKind>(event_names, name)) {
      events.push_back(*kind);
      continue;
    }
    problems_.add({recipes::child(reader.at("events"), i), "unknown event", recipes::one_of(known),
                   recipes::brief(wanted[i]), did_you_mean(name, known)});
  }
  return events;
}

WebhookSettings SettingsReader::read_webhook(const json& value, const std::string& pointer) {
  WebhookSettings webhook;
  ObjectReader reader(value, pointer, problems_);
  for (const char* const key : {"token", "password", "user"}) reader.explain(key, secret_hint);
  const auto url = reader.text("url", Need::optional);
  webhook.url = url ? *url : read_secret(reader, "url_file");
  if (url && reader.has("url_file"))
    reader.explain("url_file", "URL given twice: url and url_file");
  if (!url && !reader.has("url_file"))
    problems_.add({pointer, "URL missing", "url or url_file", "", ""});
  webhook.token = read_secret(reader, "token_file");
  webhook.ca_file = read_ca(reader);
  webhook.tls = static_cast<TlsUse>(
      reader.choice("tls", {"verified", "unverified"}, Need::optional).value_or(0));
  read_headers(reader, webhook);
  reader.leave("body");
  if (reader.has("body")) {
    check_template(reader.at("body"), value["body"]);
    webhook.body_json = value["body"].dump();
  }
  reader.finish();
  if (!webhook.url.empty()) check_url(pointer + (url ? "/url" : "/url_file"), webhook);
  return webhook;
}

// A control character in a header could start another header.
void SettingsReader::read_headers(ObjectReader& reader, WebhookSettings& webhook) {
  const json* const headers = reader.object("headers", Need::optional);
  if (headers == nullptr) return;
  for (const auto& [name, value] : headers->items()) {
    const std::string place = recipes::child(reader.at("headers"), name);
    const std::string text = value.is_string() ? value.get<std::string>() : "\n";
    static const std::regex secret("authorization", std::regex::icase), field("[A-Za-z0-9-]+");
    if (std::regex_match(name, secret))
      problems_.add({place, secret_hint, "token_file", "", ""});
    else if (!std::regex_match(name, field) || has_control(text))
      problems_.add({place, "invalid header",
                     "a name of letters, digits and -, and a value of one line",
                     recipes::brief(value), ""});
    check_template(place, value);
    webhook.headers.emplace_back(name, text);
  }
}

// Without TLS the token would be readable on the network.
void SettingsReader::check_url(const std::string& place, const WebhookSettings& webhook) {
  std::smatch found;
  static const std::regex form("(https?)://([^/?#\\s]+)([/?#]\\S*)?");
  const bool is_secret = place.ends_with("_file");
  if (!std::regex_match(webhook.url, found, form))
    return problems_.add(
        {place, "invalid URL", "https://...", is_secret ? "" : recipes::clipped(webhook.url), ""});
  const std::string authority = found[2];
  if (authority.find('@') != std::string::npos)
    return problems_.add({place, "user and password in the URL", "token_file", "", ""});
  static const std::regex here("(localhost|127\\.0\\.0\\.1|\\[::1\\])(:\\d+)?");
  const bool is_plain = found[1] == "http" && !std::regex_match(authority, here);
  if (is_plain && (is_secret || !webhook.token.empty()))
    problems_.add(
        {place, "token or secret URL without TLS", "https://...", is_secret ? "" : authority, ""});
}

MqttSettings SettingsReader::read_mqtt(const json& value, const std::string& pointer,
                                       const std::string& bench) {
  MqttSettings mqtt;
  ObjectReader reader(value, pointer, problems_);
  reader.explain("password", secret_hint);
  mqtt.host = reader.text("host").value_or("");
  mqtt.tls = static_cast<TlsUse>(
      reader.choice("tls", {"verified", "unverified", "off"}, Need::optional).value_or(0));
  mqtt.port = static_cast<int>(reader.integer("port", 1, 65535, Need::optional)
                                   .value_or(mqtt.tls == TlsUse::off ? 1883 : 8883));
  mqtt.topic = reader.text("topic", Need::optional).value_or("weft/" + bench);
  mqtt.user = reader.text("user", Need::optional).value_or("");
  mqtt.password = read_secret(reader, "password_file");
  mqtt.ca_file = read_ca(reader);
  reader.finish();
  constexpr std::size_t longest_topic = 200;
  if (mqtt.topic.empty() || mqtt.topic.size() > longest_topic || mqtt.topic.front() == '$' ||
      mqtt.topic.find_first_of("+#") != std::string::npos || has_control(mqtt.topic))
    problems_.add({reader.at("topic"), "invalid topic",
                   "at most 200 bytes, without + and #, not starting with $",
                   recipes::clipped(mqtt.topic), ""});
  if (mqtt.user.empty() && !mqtt.password.empty())
    problems_.add({pointer, "password without a user", "user", "", ""});
  return mqtt;
}

std::string SettingsReader::read_secret(ObjectReader& reader, std::string_view key) {
  const auto file = reader.text(key, Need::optional);
  if (!file) return {};
  auto secret = read_private_text(folder_ / *file);
  if (!secret && !refused_) refused_ = std::move(secret.error()).in(reader.at(key));
  return secret.value_or("");
}

std::string SettingsReader::read_ca(ObjectReader& reader) {
  const auto file = reader.text("ca_file", Need::optional);
  if (!file) return {};
  const std::filesystem::path path = folder_ / *file;
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none))
    problems_.add(
        {reader.at("ca_file"), "file not found", "CA certificates (PEM)", path.string(), ""});
  return path.string();
}

void SettingsReader::check_template(const std::string& place, const json& value) {
  if (value.is_structured()) {
    for (const auto& [key, inner] : value.items())
      check_template(recipes::child(place, key), inner);
    return;
  }
  if (!value.is_string()) return;
  std::vector<std::string> names;
  std::vector<std::string_view> known;
  for (const auto& [name, unused] : placeholder_example().items()) names.push_back(name);
  known.assign(names.begin(), names.end());
  const auto check = [&](const std::string& name) {
    if (placeholder_example().contains(name)) return;
    const std::string_view meant = closest(name, known);
    problems_.add({place, "unknown placeholder", recipes::one_of(known), "{" + name + "}",
                   meant.empty() ? "" : "Did you mean {" + std::string(meant) + "}?"});
  };
  for_parts(
      value.get<std::string>(), [](const std::string&) {}, check);
}

json expanded(const json& value, const json& event) {
  if (value.is_structured()) {
    json out = value;
    for (json& inner : out) inner = expanded(inner, event);
    return out;
  }
  if (!value.is_string()) return value;
  const std::string text = value.get<std::string>();
  const bool is_one = text.size() > 2 && text.front() == '{' && text.back() == '}';
  const std::string name = is_one ? text.substr(1, text.size() - 2) : "";
  return event.contains(name) ? event.at(name) : json(expand(text, event));
}

}  // namespace

std::string expand(const std::string& text, const json& event) {
  std::string out;
  for_parts(
      text, [&](const std::string& part) { out += part; },
      [&](const std::string& name) {
        const json value = event.value(name, json(""));
        out += value.is_string() ? value.get<std::string>() : value.dump();
      });
  return out;
}

std::string expand_body(const std::string& body_json, const json& event) {
  if (body_json.empty()) return format_event_json(event);
  const json body = json::parse(body_json);
  if (body.is_string()) return expand(body.get<std::string>(), event);
  return format_event_json(expanded(body, event));
}

Result<NotifySettings> load_notify_settings(const std::filesystem::path& file,
                                            const std::string& bench) {
  const auto text = read_text_file(file);
  if (!text) return pass(text.error());
  Problems problems;
  json document;
  NotifySettings settings;
  if (recipes::parse_json(*text, {}, document, problems)) {
    SettingsReader reader(std::filesystem::absolute(file).parent_path(), problems);
    settings = reader.read(document, bench);
    if (reader.refused()) return pass(*reader.refused(), file.string());
  }
  const auto found = problems.take();
  if (found.empty()) return settings;
  const recipes::Diagnostic& first = found.front();
  return fail({.code = Errc::parse,
               .where = file.string() + ": " + first.pointer,
               .what = first.message,
               .expected = first.expected,
               .got = first.got,
               .hint = first.hint});
}

}  // namespace weft::daemon::notify
