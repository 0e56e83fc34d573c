#pragma once

#include <glint/device/program.h>
#include <glint/device/types.h>
#include <glint/format/format.h>

#include <vector>

namespace glint {

/// A graphics pipeline. Created by Device::createPipeline, configured, then create().
///
/// Conventions: clip-space Y points up, depth runs from 0 to 1, row 0 of a target is its top row; front faces are
/// counter-clockwise as seen on the picture unless setFrontMode says otherwise. Nothing is culled by default.
class Pipeline : public Program {
public:
    enum Attribute : uint8_t {
        AttributePosition,
        AttributeBasis,
        AttributeNormal,
        AttributeTangent,
        AttributeTexCoord,
        AttributeWeights,
        AttributeJoints,
        AttributeColor,
        AttributeCustom,
    };
    enum PrimitiveType : uint8_t {
        PrimitivePoint,
        PrimitiveLine,
        PrimitiveLineStrip,
        PrimitiveTriangle,
        PrimitiveTriangleStrip,
        PrimitivePatch,  ///< of three vertices; needs control and evaluate shaders
    };
    enum FillModeType : uint8_t { FillModeSolid, FillModeLine };
    enum CullModeType : uint8_t { CullModeNone, CullModeBack, CullModeFront };
    enum FrontModeType : uint8_t { FrontModeCCW, FrontModeCW };
    enum DepthFunc : uint8_t {
        DepthFuncNever,
        DepthFuncLess,
        DepthFuncEqual,
        DepthFuncLessEqual,
        DepthFuncGreater,
        DepthFuncNotEqual,
        DepthFuncGreaterEqual,
        DepthFuncAlways,
        DepthFuncNone,  ///< no depth test
    };
    enum BlendOp : uint8_t { BlendOpAdd, BlendOpSub, BlendOpRevSub, BlendOpMin, BlendOpMax, BlendOpNone };
    enum BlendFunc : uint8_t {
        BlendFuncZero,
        BlendFuncOne,
        BlendFuncSrcColor,
        BlendFuncInvSrcColor,
        BlendFuncSrcAlpha,
        BlendFuncInvSrcAlpha,
        BlendFuncDestColor,
        BlendFuncInvDestColor,
        BlendFuncDestAlpha,
        BlendFuncInvDestAlpha,
        BlendFuncFactor,
        BlendFuncInvFactor,
    };
    enum StencilOp : uint8_t {
        StencilOpKeep,
        StencilOpZero,
        StencilOpReplace,
        StencilOpInvert,
        StencilOpIncrWrap,
        StencilOpDecrWrap,
        StencilOpIncrSat,
        StencilOpDecrSat,
    };
    enum ColorMask : uint8_t {
        ColorMaskNone = 0,
        ColorMaskR = 1,
        ColorMaskG = 2,
        ColorMaskB = 4,
        ColorMaskA = 8,
        ColorMaskAll = 15,
    };

    /// What one addAttribute says.
    struct VertexAttribute {
        Attribute attribute = AttributeCustom;
        Format format = FormatUnknown;
        uint32_t buffer = 0;  ///< slot of Command::setVertexBuffer
        uint32_t offset = 0;  ///< bytes from the beginning of a vertex
        uint32_t stride = 0;  ///< bytes from vertex to vertex
        uint32_t rate = 0;    ///< 0 steps by vertex, 1 by instance
        bool operator==(const VertexAttribute&) const = default;
    };

    Pipeline() = default;
    explicit Pipeline(detail::Object* object) : Program(object) {}

    /// Loads and compiles one stage. True if that worked; otherwise the error is kept for create().
    bool loadShaderGLSL(Shader::Type type, std::string_view path, std::string_view macros = {},
                        Where where = Where::current()) {
        return load(Shader::loadGLSL(type, path, macros, where), where);
    }
    bool createShaderGLSL(Shader::Type type, std::string_view text, std::string_view macros = {},
                          Where where = Where::current()) {
        return load(Shader::createGLSL(type, text, macros, "pipeline", where), where);
    }
    bool loadShaderSPIRV(Shader::Type type, std::string_view path, Where where = Where::current()) {
        return load(Shader::loadSPIRV(type, path, where), where);
    }

    /// Adds the next attribute: locations count up from 0 in the order of the calls. `buffer` is the slot of
    /// Command::setVertexBuffer; `rate` 0 steps by vertex, 1 by instance. At most 16 attributes and buffers, strides of
    /// 1 to 2048 bytes; offset and stride are multiples of a component's size. What the shader does not read is not
    /// fetched. Errors: "pipeline.attribute".
    void addAttribute(Attribute attribute, Format format, uint32_t buffer, uint32_t offset, uint32_t stride,
                      uint32_t rate = 0, Where where = Where::current());
    /// The attributes added so far, by location. `attribute` says what a MeshModel puts there.
    std::vector<VertexAttribute> getAttributes() const;

    void setPrimitive(PrimitiveType primitive, Where where = Where::current());
    void setFillMode(FillModeType mode, Where where = Where::current());
    void setCullMode(CullModeType mode, Where where = Where::current());
    void setFrontMode(FrontModeType mode, Where where = Where::current());
    void setDepthFunc(DepthFunc func, Where where = Where::current());
    void setDepthMask(bool write, Where where = Where::current());
    void setDepthBias(float bias, float slope, Where where = Where::current());
    /// Fragments beyond the depth range are kept, their depth clamped; needs FeatureDepthClamp.
    void setDepthClamp(bool enabled, Where where = Where::current());
    /// The stencil test of both faces: `reference FUNC stored`, and what happens to what is stored. DepthFuncNone: no
    /// test.
    void setStencilFunc(DepthFunc func, StencilOp fail, StencilOp depth_fail, StencilOp pass,
                        Where where = Where::current());
    /// The same of front faces, or of back faces, alone (points and lines are front faces). Of a face without a test
    /// all fragments pass and nothing is stored.
    void setStencilFrontFunc(DepthFunc func, StencilOp fail, StencilOp depth_fail, StencilOp pass,
                             Where where = Where::current());
    void setStencilBackFunc(DepthFunc func, StencilOp fail, StencilOp depth_fail, StencilOp pass,
                            Where where = Where::current());
    /// Bits that are compared and bits that are stored, of both faces.
    void setStencilMask(uint8_t read, uint8_t write, Where where = Where::current());
    /// Blending of all colour targets, colour and alpha alike.
    void setBlend(BlendOp op, BlendFunc source, BlendFunc destination, Where where = Where::current());
    void setBlendColor(uint32_t index, BlendOp op, BlendFunc source, BlendFunc destination,
                       Where where = Where::current());
    void setBlendAlpha(uint32_t index, BlendOp op, BlendFunc source, BlendFunc destination,
                       Where where = Where::current());
    void setColorMask(uint8_t mask, uint32_t index = 0, Where where = Where::current());
    /// Formats of the targets that the pipeline draws to; FormatUnknown removes one.
    void setColorFormat(Format format, uint32_t index = 0, Where where = Where::current());
    void setDepthFormat(Format format, Where where = Where::current());
    /// Samples a pixel: 1, 2, 4 or 8.
    void setMultisample(uint32_t samples, Where where = Where::current());
    void setAlphaToCoverage(bool enabled, Where where = Where::current());
};

}  // namespace glint
