// OpenCV's FileStorage as XML, read into the same tree as its YAML: elements, text and comments, nothing else
// of XML. (cv::FileStorage reads it too, but knows no lines to name in a message, and recurses as deep as the
// file.)
#include <algorithm>

#include <fmt/format.h>

#include "pade/io/sequence/dialects/calibration_dialects.hpp"
#include "pade/io/text.hpp"

namespace pade::io::dialect {
namespace {

constexpr int kDeepest = 16;
constexpr std::string_view kBlanks = " \t\r\n";

/// Goes through the text and remembers the first thing that was wrong.
class Reader {
 public:
  Reader(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}

  Result<Yaml> document() {
    pass_comments();
    const Tag root = tag();
    if (!error_ && (root.closes || root.name != "opencv_storage")) {
      return Error{
          fmt::format("{}: line {}: found XML of <{}>, expected <opencv_storage>, as OpenCV writes its "
                      "calibrations (known dialects: docs/formats.md)",
                      file_, line_, root.name)};
    }
    Yaml content;
    content.kind = Yaml::Kind::map;
    if (!root.empty) content = element("opencv_storage", 0);
    if (error_) return *error_;
    if (content.kind != Yaml::Kind::map)
      fail("found <opencv_storage> without fields, expected a calibration");
    if (error_) return *error_;
    return content;
  }

 private:
  struct Tag {
    std::string name;
    bool closes = false;  ///< </name>
    bool empty = false;   ///< <name/>
  };

  void fail(const std::string& what) {
    if (!error_) error_ = Error{fmt::format("{}: line {}: {}", file_, line_, what)};
  }
  [[nodiscard]] bool at(std::string_view what) const { return text_.starts_with(what); }
  void pass(std::size_t count) {
    count = std::min(count, text_.size());
    line_ += static_cast<std::size_t>(
        std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(count), '\n'));
    text_.remove_prefix(count);
  }
  /// Passes the text up to and with `end`.
  void pass_through(std::string_view end) {
    const std::size_t found = text_.find(end);
    if (found == std::string_view::npos) fail(fmt::format("found no '{}': the file is cut short", end));
    pass(found == std::string_view::npos ? text_.size() : found + end.size());
  }
  void pass_comments() {
    while (true) {
      pass(std::min(text_.find_first_not_of(kBlanks), text_.size()));
      if (at("<?")) {
        pass_through("?>");
      } else if (at("<!--")) {
        pass_through("-->");
      } else {
        return;
      }
    }
  }

  Tag tag() {
    Tag tag;
    if (!at("<")) {
      fail(fmt::format("found {}, expected a tag",
                       text_.empty() ? "the end of the file" : in_quotes(text_.substr(0, 20))));
      return tag;
    }
    const std::size_t end = text_.find('>');
    if (end == std::string_view::npos) {
      fail("found a tag without '>': the file is cut short");
      return tag;
    }
    std::string_view inside = text_.substr(1, end - 1);
    tag.closes = inside.starts_with('/');
    tag.empty = inside.ends_with('/');
    if (tag.closes) inside.remove_prefix(1);
    tag.name = std::string(inside.substr(0, std::min(inside.find_first_of(" \t\r\n/"), inside.size())));
    if (tag.name.empty()) fail(fmt::format("found {}, expected the name of a field", in_quotes(inside)));
    if (!error_) pass(end + 1);
    return tag;
  }

  /// What stands between <name> and </name>.
  Yaml element(const std::string& name, int depth) {
    Yaml node;
    node.line = line_;
    if (depth > kDeepest) fail(fmt::format("nested deeper than {} levels", kDeepest));
    std::string content;
    while (!error_) {
      const std::size_t next = std::min(text_.find('<'), text_.size());
      content += text_.substr(0, next);
      pass(next);
      if (at("<!--")) {
        pass_through("-->");
        continue;
      }
      const Tag tag = this->tag();
      if (error_) break;
      if (tag.closes) {
        if (tag.name != name) fail(fmt::format("found </{}>, expected </{}>", tag.name, name));
        break;
      }
      add(node, tag, depth);
    }
    if (!error_ && node.kind == Yaml::Kind::null) set_text(node, name, content);
    return node;
  }

  /// A field of a map; elements of a list are called _.
  void add(Yaml& node, const Tag& tag, int depth) {
    const Yaml::Kind kind = tag.name == "_" ? Yaml::Kind::list : Yaml::Kind::map;
    if (node.kind != Yaml::Kind::null && node.kind != kind)
      return fail("found fields among the values of a list");
    node.kind = kind;
    Yaml value;
    value.line = line_;
    if (!tag.empty) value = element(tag.name, depth + 1);
    if (kind == Yaml::Kind::list) {
      node.list.push_back(std::move(value));
      return;
    }
    if (std::any_of(node.map.begin(), node.map.end(),
                    [&](const Yaml::Entry& e) { return e.key == tag.name; })) {
      return fail(fmt::format("field {} appears twice", tag.name));
    }
    node.map.push_back({tag.name, std::move(value)});
  }

  /// Text is one value, or several between blanks: the data of a matrix always are.
  static void set_text(Yaml& node, const std::string& name, std::string_view content) {
    const std::size_t first = std::min(content.find_first_not_of(kBlanks), content.size());
    content.remove_prefix(first);
    content = content.substr(0, content.find_last_not_of(kBlanks) + 1);
    if (content.empty()) return;
    if (content.front() == '"' && content.size() > 1) content = content.substr(1, content.size() - 2);
    const bool several = name == "data" || content.find_first_of(kBlanks) != std::string_view::npos;
    if (!several) {
      node.kind = Yaml::Kind::scalar;
      node.scalar = std::string(content);
      return;
    }
    node.kind = Yaml::Kind::list;
    while (!content.empty()) {
      const std::size_t end = std::min(content.find_first_of(kBlanks), content.size());
      Yaml value;
      value.kind = Yaml::Kind::scalar;
      value.line = node.line;
      value.scalar = std::string(content.substr(0, end));
      node.list.push_back(std::move(value));
      content.remove_prefix(std::min(content.find_first_not_of(kBlanks, end), content.size()));
    }
  }

  std::string_view text_;
  std::string file_;
  std::size_t line_ = 1;
  std::optional<Error> error_;
};

}  // namespace

Result<Yaml> parse_opencv_xml(std::string_view text, const std::string& file) {
  return Reader(text, file).document();
}

}  // namespace pade::io::dialect
