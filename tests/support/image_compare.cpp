#include "support/image_compare.h"

#include "support/files.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace glint::test {

namespace {

bool isReadable(Format format) {
    Expected<Image> image = Image::create(format, 1, 1);
    return image && image->convert(FormatRGBAf32).has_value();
}

Vector4f heat(float difference, float threshold) {
    if (difference == 0.0f) return {0, 0, 0, 1};
    const float step = std::max(threshold, 1e-6f);
    if (difference <= threshold) return {0, 0, 0.25f + 0.75f * difference / step, 1};
    // Logarithmic from red over yellow to white; NaN is white.
    const float excess = std::isnan(difference) ? 1.0f : std::clamp(std::log2(difference / step) / 4.0f, 0.0f, 1.0f);
    return {1, std::min(2 * excess, 1.0f), std::max(2 * excess - 1, 0.0f), 1};
}

std::filesystem::path savePicture(const Image& image, const std::string& name) {
    std::filesystem::path path = outputDir() / (name + ".png");
    std::filesystem::create_directories(path.parent_path());
    const Expected<Image> picture = image.convert(FormatRGBAu8n);
    if (!picture || !picture->save(path)) return {};
    return path;
}

}  // namespace

ImageDifference compareImages(const Image& actual, const Image& expected, float threshold) {
    ImageDifference result;
    const uint32_t width = expected.width();
    const uint32_t height = expected.height();
    if (actual.width() != width || actual.height() != height || !isReadable(actual.format()) ||
        !isReadable(expected.format()))
        return result;
    Expected<Image> heat_map = Image::create(FormatRGBAu8n, width, height);
    if (!heat_map) return result;
    result.is_comparable = true;
    double sum = 0.0;
    for (uint32_t y = 0; y < height; y++) {
        for (uint32_t x = 0; x < width; x++) {
            const Vector4f a = actual.load(x, y);
            const Vector4f b = expected.load(x, y);
            float worst = 0.0f;
            for (int i = 0; i < 4; i++) {
                // Equal infinities have a difference of NaN.
                const float difference = a[i] == b[i] ? 0.0f : std::abs(a[i] - b[i]);
                if (!(difference <= worst)) worst = difference;
                if (std::isnan(worst)) break;
                sum += static_cast<double>(difference) * static_cast<double>(difference);
            }
            if (!(worst <= threshold)) result.differing++;
            if (!(worst <= result.largest) && !std::isnan(result.largest)) result.largest = worst;
            heat_map->store(x, y, heat(worst, threshold));
        }
    }
    result.mean_square = sum / (4.0 * width * height);
    result.heat_map = std::move(*heat_map);
    return result;
}

testing::AssertionResult imagesMatch(const Image& actual, const Image& expected, const std::string& name,
                                     const ImageTolerance& tolerance) {
    const ImageDifference difference = compareImages(actual, expected, tolerance.channel);
    if (!difference.is_comparable)
        return testing::AssertionFailure() << name << ": cannot compare " << actual.width() << "x" << actual.height()
                                           << " " << toString(actual.format()) << " with " << expected.width() << "x"
                                           << expected.height() << " " << toString(expected.format());
    if (difference.differing <= tolerance.texels) return testing::AssertionSuccess();
    savePicture(expected, name + ".expected");
    savePicture(difference.heat_map, name + ".heat");
    const std::filesystem::path path = savePicture(actual, name + ".actual");
    return testing::AssertionFailure() << name << ": " << difference.differing << " texels differ by more than "
                                       << tolerance.channel << ", " << tolerance.texels
                                       << " may; the largest difference is " << difference.largest
                                       << ", the root mean square " << std::sqrt(difference.mean_square) << "; see "
                                       << path.string();
}

testing::AssertionResult matchesGolden(const Image& actual, const std::string& name, const ImageTolerance& tolerance) {
    const std::filesystem::path path = testsDir() / "golden" / (name + ".png");
    const char* update = std::getenv("GLINT_UPDATE_GOLDEN");
    if (update && std::string_view(update) == "1") {
        std::filesystem::create_directories(path.parent_path());
        if (Status status = actual.save(path); !status) return testing::AssertionFailure() << status.error().text();
        return testing::AssertionSuccess();
    }
    const Expected<Image> expected = Image::load(path);
    if (!expected) {
        const std::filesystem::path picture = savePicture(actual, name + ".actual");
        return testing::AssertionFailure() << expected.error().text() << "; what was drawn is " << picture.string();
    }
    return imagesMatch(actual, *expected, name, tolerance);
}

}  // namespace glint::test
