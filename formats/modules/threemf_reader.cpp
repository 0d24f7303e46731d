// SPDX-License-Identifier: Apache-2.0
// The program peeler_3mf, which reads one 3MF package with lib3mf 1.8 (formats/meshes/
// threemf_scene.cpp).
#include <Common/NMR_ErrorConst.h>
#include <Model/COM/NMR_DLLInterfaces.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <map>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "formats/meshes/threemf_model.h"
#include "formats/modules/helper_main.h"

namespace peeler {
namespace {

struct Release {
    void operator()(NMR::PLib3MFBase* object) const { NMR::lib3mf_release(object); }
};
using Object3mf = std::unique_ptr<NMR::PLib3MFBase, Release>;

/// Throws Error (kInput) if a call of lib3mf failed.
void check(LIB3MFRESULT result) {
    if (result != LIB3MF_OK)
        throw Error(ErrorKind::kInput, "lib3mf cannot read the model, which is damaged");
}

/// Returns what a function of lib3mf returns through its last parameter.
template <class Value, class Function, class... Arguments>
Value valueOf(Function function, Arguments... arguments) {
    Value value{};
    check(function(arguments..., &value));
    return value;
}
template <class Function, class... Arguments>
Object3mf objectOf(Function function, Arguments... arguments) {
    return Object3mf(valueOf<NMR::PLib3MFBase*>(function, arguments...));
}

/// Returns a text; `function` fills a buffer of the given size, or only returns the size.
template <class Function>
std::string textOf(Function function) {
    ULONG size = 0;
    check(function(nullptr, 0, &size));
    std::string text(std::size_t{size} + 1, '\0');
    check(function(text.data(), size + 1, &size));
    text.resize(std::min<std::size_t>(size, text.size() - 1));
    return text;
}

std::string nameOf(NMR::PLib3MFBase* object) {
    for (const auto function :
         {NMR::lib3mf_object_getnameutf8, NMR::lib3mf_object_getpartnumberutf8}) {
        std::string name = textOf([&](LPSTR to, ULONG size, ULONG* needed) {
            return function(object, to, size, needed);
        });
        if (!name.empty()) return name;
    }
    return {};
}

ThreeMfPlacement placementOf(std::uint32_t object, const NMR::MODELTRANSFORM& transform) {
    ThreeMfPlacement placement{object, {}};
    for (std::size_t row = 0; row < 3; ++row)
        std::ranges::copy(transform.m_fFields[row], placement.rows[row].begin());
    return placement;
}

ThreeMfColor colorOf(const NMR::MODELMESHCOLOR_SRGB& color) {
    return {color.m_Red, color.m_Green, color.m_Blue, color.m_Alpha};
}

/// The sentence for a warning of lib3mf; empty if the warning concerns nothing that peeler shows.
struct Sentence {
    DWORD code;
    const char* text;
};
constexpr Sentence kSentences[] = {
    {NMR_ERROR_NAMESPACE_INVALID_ELEMENT,
     "Elements that lib3mf does not know are not read (such as composite materials and multiple "
     "properties)."},
    {NMR_ERROR_INVALIDMODELUNIT, "The file's unit is none of 3MF, and counts as millimetres."},
    {NMR_ERROR_UNKNOWNMETADATA, ""},
    {NMR_ERROR_INVALIDMETADATA, ""},
    {NMR_ERROR_DUPLICATEMETADATA, ""},
    {NMR_ERROR_MISSINGUUID, ""},
    {NMR_ERROR_DUPLICATEUUID, ""},
    {NMR_ERROR_NOTEXTURESTREAM, ""},
    {NMR_ERROR_MISSINGDEFAULTPID, ""},  // triangles without a property are neutral
};

class ModelReader {
  public:
    explicit ModelReader(SharedFile& result) : result_(result) {
        NMR::PLib3MFModel* model = nullptr;
        check(NMR::lib3mf_createmodel(&model));
        model_.reset(model);
    }

    void read(std::vector<std::uint8_t> bytes) {
        const Object3mf reader = objectOf(NMR::lib3mf_model_queryreader, model_.get(), "3mf");
        if (NMR::lib3mf_reader_readfrombuffer(reader.get(), bytes.data(), bytes.size()) !=
            LIB3MF_OK)
            fail(reader.get());
        result_.putOne(std::uint32_t{valueOf<DWORD>(NMR::lib3mf_model_getunit, model_.get())});
        putTexts(warningsOf(reader.get()));
        putMaterials();
        putObjects();
        putItems();
    }

  private:
    /// Throws the Error of a failed read.
    [[noreturn]] static void fail(NMR::PLib3MFBase* reader) {
        DWORD code = 0;
        LPCSTR message = nullptr;
        NMR::lib3mf_getlasterror(reader, &code, &message);
        // lib3mf reports a std::bad_alloc as one of these.
        if (code == NMR_ERROR_GENERICEXCEPTION || code == NMR_ERROR_INVALIDBUFFERSIZE)
            throw std::bad_alloc();
        throw Error(ErrorKind::kInput,
                    "lib3mf cannot read the model: " +
                        std::string(message ? message : "error " + std::to_string(code)));
    }

    /// Returns lib3mf's warnings without repetitions. Throws Error (kInput) if the file requires an
    /// extension that lib3mf lacks.
    static std::vector<std::string> warningsOf(NMR::PLib3MFBase* reader) {
        std::vector<std::string> warnings;
        const DWORD count = valueOf<DWORD>(NMR::lib3mf_reader_getwarningcount, reader);
        for (DWORD i = 0; i < count; ++i) {
            DWORD code = 0;
            const std::string text = textOf([&](LPSTR to, ULONG size, ULONG* needed) {
                return NMR::lib3mf_reader_getwarningutf8(reader, i, &code, to, size, needed);
            });
            if (code == NMR_ERROR_REQUIREDEXTENSIONNOTSUPPORTED)
                throw Error(ErrorKind::kInput,
                            "the file requires an extension of 3MF that peeler does not read");
            const auto* const row = std::ranges::find(kSentences, code, &Sentence::code);
            const std::string sentence =
                row == std::end(kSentences) ? "lib3mf warns: " + text : row->text;
            if (!sentence.empty() && std::ranges::find(warnings, sentence) == warnings.end())
                warnings.push_back(sentence);
        }
        return warnings;
    }

    void putMaterials() {
        std::vector<std::string> names;
        std::vector<ThreeMfColor> colors;
        const Object3mf each = objectOf(NMR::lib3mf_model_getbasematerials, model_.get());
        while (valueOf<BOOL>(NMR::lib3mf_resourceiterator_movenext, each.get())) {
            const Object3mf group = objectOf(NMR::lib3mf_resourceiterator_getcurrent, each.get());
            const DWORD id = valueOf<DWORD>(NMR::lib3mf_resource_getresourceid, group.get());
            const DWORD count = valueOf<DWORD>(NMR::lib3mf_basematerial_getcount, group.get());
            groups_[id] = {static_cast<std::uint32_t>(colors.size()), count};
            for (DWORD i = 0; i < count; ++i) {
                names.push_back(textOf([&](LPSTR to, ULONG size, ULONG* needed) {
                    return NMR::lib3mf_basematerial_getnameutf8(group.get(), i, to, size, needed);
                }));
                ThreeMfColor color{};
                check(NMR::lib3mf_basematerial_getdisplaycolor(group.get(), i, &color[0], &color[1],
                                                               &color[2], &color[3]));
                colors.push_back(color);
            }
        }
        putTexts(names);
        result_.put(colors);
    }

    void putObjects() {
        std::vector<Object3mf> objects;
        const Object3mf each = objectOf(NMR::lib3mf_model_getobjects, model_.get());
        while (valueOf<BOOL>(NMR::lib3mf_resourceiterator_movenext, each.get()))
            objects.push_back(objectOf(NMR::lib3mf_resourceiterator_getcurrent, each.get()));
        result_.putOne(static_cast<std::uint32_t>(objects.size()));
        for (const Object3mf& object : objects) {
            const DWORD id = valueOf<DWORD>(NMR::lib3mf_resource_getresourceid, object.get());
            if (valueOf<BOOL>(NMR::lib3mf_object_ismeshobject, object.get()))
                putMesh(id, object.get());
            else
                putComponents(id, object.get());
            indices_.emplace(id, static_cast<std::uint32_t>(indices_.size()));
        }
    }

    static std::uint32_t lostBy(NMR::PLib3MFBase* object) {
        const DWORD type = valueOf<DWORD>(NMR::lib3mf_object_gettype, object);
        if (type == NMR::MODELOBJECTTYPE_OTHER) return kThreeMfOther;
        const bool support =
            type == NMR::MODELOBJECTTYPE_SUPPORT || type == NMR::MODELOBJECTTYPE_SOLIDSUPPORT;
        return support ? std::uint32_t{kThreeMfSupport} : 0;
    }

    void putMesh(DWORD id, NMR::PLib3MFBase* mesh) {
        const DWORD vertices = valueOf<DWORD>(NMR::lib3mf_meshobject_getvertexcount, mesh),
                    triangles = valueOf<DWORD>(NMR::lib3mf_meshobject_gettrianglecount, mesh);
        ThreeMfObject record{id, lostBy(mesh), vertices, triangles, 0, 0};
        if (valueOf<DWORD>(NMR::lib3mf_meshobject_getbeamcount, mesh) > 0)
            record.lost |= kThreeMfBeams;
        if (valueOf<DWORD>(NMR::lib3mf_meshobject_getslicestackid, mesh) > 0)
            record.lost |= kThreeMfSlices;
        std::vector<std::uint32_t> properties;
        std::vector<ThreeMfColor> colors;
        readProperties(mesh, record, properties, colors);
        record.has_colors = colors.empty() ? 0 : 1;
        result_.putOne(record);
        putText(nameOf(mesh));
        static_assert(sizeof(ThreeMfVertex) == sizeof(NMR::MODELMESHVERTEX));
        static_assert(sizeof(ThreeMfTriangle) == sizeof(NMR::MODELMESHTRIANGLE));
        std::vector<NMR::MODELMESHVERTEX> positions(vertices);
        std::vector<NMR::MODELMESHTRIANGLE> indices(triangles);
        if (vertices > 0)
            check(NMR::lib3mf_meshobject_getvertices(mesh, positions.data(), vertices, nullptr));
        if (triangles > 0)
            check(NMR::lib3mf_meshobject_gettriangleindices(mesh, indices.data(), triangles,
                                                            nullptr));
        result_.put(positions);
        result_.put(indices);
        result_.put(properties);
        result_.put(colors);
        result_.put(std::vector<ThreeMfPlacement>());
    }

    void readProperties(NMR::PLib3MFBase* mesh, ThreeMfObject& record,
                        std::vector<std::uint32_t>& properties, std::vector<ThreeMfColor>& colors) {
        const Object3mf each = objectOf(NMR::lib3mf_meshobject_createpropertyhandler, mesh);
        properties.resize(record.triangles, kThreeMfNothing);
        for (DWORD i = 0; i < record.triangles; ++i) {
            switch (valueOf<NMR::eModelPropertyType>(NMR::lib3mf_propertyhandler_getpropertytype,
                                                     each.get(), i)) {
                case NMR::MODELPROPERTYTYPE_BASEMATERIALS:
                    properties[i] = materialOf(each.get(), i);
                    if (properties[i] == kThreeMfNothing) record.lost |= kThreeMfUnknownProperties;
                    break;
                case NMR::MODELPROPERTYTYPE_COLOR: {
                    properties[i] = kThreeMfCornerColors;
                    colors.resize(std::size_t{3} * record.triangles);
                    const auto found = valueOf<NMR::MODELMESH_TRIANGLECOLOR_SRGB>(
                        NMR::lib3mf_propertyhandler_getcolor, each.get(), i);
                    std::ranges::transform(found.m_Colors, &colors[std::size_t{3} * i], colorOf);
                    break;
                }
                case NMR::MODELPROPERTYTYPE_TEXCOORD2D:
                    record.lost |= kThreeMfTextures;
                    break;
                case NMR::MODELPROPERTYTYPE_COMPOSITE:
                    record.lost |= kThreeMfUnknownProperties;
                    break;
                case NMR::MODELPROPERTYTYPE_NONE:
                    break;
            }
        }
    }

    std::uint32_t materialOf(NMR::PLib3MFBase* properties, DWORD triangle) const {
        DWORD group = 0, index = 0;
        check(NMR::lib3mf_propertyhandler_getbasematerial(properties, triangle, &group, &index));
        const auto found = groups_.find(group);
        const bool known = found != groups_.end() && index < found->second.count;
        return known ? found->second.first + index : kThreeMfNothing;
    }

    void putComponents(DWORD id, NMR::PLib3MFBase* object) {
        const DWORD count = valueOf<DWORD>(NMR::lib3mf_componentsobject_getcomponentcount, object);
        ThreeMfObject record{id, lostBy(object), 0, 0, count, 0};
        if (valueOf<DWORD>(NMR::lib3mf_componentsobject_getslicestackid, object) > 0)
            record.lost |= kThreeMfSlices;
        std::vector<ThreeMfPlacement> components;
        for (DWORD i = 0; i < count; ++i) {
            const Object3mf component =
                objectOf(NMR::lib3mf_componentsobject_getcomponent, object, i);
            components.push_back(placementOf(
                indexOf(valueOf<DWORD>(NMR::lib3mf_component_getobjectresourceid, component.get())),
                valueOf<NMR::MODELTRANSFORM>(NMR::lib3mf_component_gettransform, component.get())));
        }
        result_.putOne(record);
        putText(nameOf(object));
        result_.put(std::vector<ThreeMfVertex>());
        result_.put(std::vector<ThreeMfTriangle>());
        result_.put(std::vector<std::uint32_t>());
        result_.put(std::vector<ThreeMfColor>());
        result_.put(components);
    }

    void putItems() {
        std::vector<ThreeMfPlacement> items;
        const Object3mf each = objectOf(NMR::lib3mf_model_getbuilditems, model_.get());
        while (valueOf<BOOL>(NMR::lib3mf_builditemiterator_movenext, each.get())) {
            const Object3mf item = objectOf(NMR::lib3mf_builditemiterator_getcurrent, each.get());
            items.push_back(placementOf(
                indexOf(valueOf<DWORD>(NMR::lib3mf_builditem_getobjectresourceid, item.get())),
                valueOf<NMR::MODELTRANSFORM>(NMR::lib3mf_builditem_getobjecttransform,
                                             item.get())));
        }
        result_.putOne(static_cast<std::uint32_t>(items.size()));
        result_.put(items);
    }

    void putText(const std::string& text) { result_.put(std::span<const char>(text)); }
    void putTexts(const std::vector<std::string>& texts) {
        result_.putOne(static_cast<std::uint32_t>(texts.size()));
        for (const std::string& text : texts)
            putText(text);
    }

    /// Returns the index of an object that comes before the current one.
    std::uint32_t indexOf(DWORD id) const {
        const auto found = indices_.find(id);
        if (found == indices_.end())
            throw Error(ErrorKind::kInput, "an object refers to one that does not come before it");
        return found->second;
    }

    struct Group {
        std::uint32_t first = 0, count = 0;  ///< indices of materials
    };

    SharedFile& result_;
    Object3mf model_;
    std::map<DWORD, Group> groups_;           ///< groups of materials, by resource id
    std::map<DWORD, std::uint32_t> indices_;  ///< indices of objects, by resource id
};

void readRequest(SharedFile& request, SharedFile& result) {
    const auto limits = request.takeOne<ThreeMfLimits>();
    limitMemory(limits.bytes);
    try {
        ModelReader(result).read(request.take<std::uint8_t>());
    } catch (const std::bad_alloc&) {
        if (limits.bytes < limits.needed)
            throw Error(ErrorKind::kMemory, "not enough memory to read the model");
        throw Error(ErrorKind::kInput,
                    "reading the model takes too much memory for its size: it is damaged");
    }
}

}  // namespace
}  // namespace peeler

int main(int count, char** arguments) {
    // libzip converts dates. For this, the C library would read the time-zone file or check whether
    // it has changed, but the filter of system calls allows neither. So chooses UTC, and loads it
    // before the filter is set.
    setenv("TZ", "", 1);
    tzset();
    peeler::helperMain(count, arguments, peeler::readRequest);
}
