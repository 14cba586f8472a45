//! Words that no value of a kernel may be named: the language's and those of the texts around the kernel.

/// Keywords, reserved words and predeclared names in lower case; the others cannot be met in snake_case.
/// WGSL, W3C Candidate Recommendation, sections 15.3, 15.4, 6.9, 6.3.1 and 17.
const LANGUAGE: &str = "
    alias break case const const_assert continue continuing default diagnostic discard else enable false fn for if let
    loop override requires return struct switch true var while
    abstract active alignas alignof as asm asm_fragment async attribute auto await become cast catch class co_await
    co_return co_yield coherent column_major common compile compile_fragment concept const_cast consteval constexpr
    constinit crate debugger decltype delete demote demote_to_helper do dynamic_cast enum explicit export extends extern
    external fallthrough filter final finally friend from fxgroup get goto groupshared highp impl implements import
    inline instanceof interface layout lowp macro macro_rules match mediump meta mod module move mut mutable namespace
    new nil noexcept noinline nointerpolation non_coherent noncoherent noperspective null nullptr of operator package
    packoffset partition pass patch pixelfragment precise precision premerge priv protected pub public readonly ref
    regardless register reinterpret_cast require resource restrict self set shared sizeof smooth snorm static
    static_assert static_cast std subroutine super target template this thread_local throw trait try type typedef typeid
    typename typeof union unless unorm unsafe unsized use using varying virtual volatile wgsl where with writeonly yield
    bool i32 u32 f32 f16 f64 array atomic vec2 vec3 vec4 mat2x2 mat2x3 mat2x4 mat3x2 mat3x3 mat3x4 mat4x2 mat4x3 mat4x4
    vec2i vec3i vec4i vec2u vec3u vec4u vec2f vec3f vec4f vec2h vec3h vec4h ptr sampler sampler_comparison
    read write read_write function private workgroup uniform storage
    bitcast all any select abs acos acosh asin asinh atan atanh atan2 ceil clamp cos cosh cross degrees determinant
    distance dot exp exp2 floor fma fract frexp ldexp length log log2 max min mix modf normalize pow radians reflect
    refract round saturate sign sin sinh smoothstep sqrt step tan tanh transpose trunc dpdx dpdy fwidth
    texture_1d texture_2d texture_2d_array texture_3d texture_cube texture_cube_array texture_multisampled_2d
    texture_depth_multisampled_2d texture_external texture_storage_1d texture_storage_2d
    texture_storage_2d_array texture_storage_3d texture_depth_2d texture_depth_2d_array texture_depth_cube
    texture_depth_cube_array rgba8unorm rgba8snorm rgba8uint rgba8sint rgba16unorm rgba16snorm rgba16uint
    rgba16sint rgba16float rg8unorm rg8snorm rg8uint rg8sint rg16unorm rg16snorm rg16uint rg16sint rg16float
    r32uint r32sint r32float rg32uint rg32sint rg32float rgba32uint rgba32sint rgba32float bgra8unorm r8unorm
    r8snorm r8uint r8sint r16unorm r16snorm r16uint r16sint r16float rgb10a2unorm rgb10a2uint rg11b10ufloat
    pack4x8snorm pack4x8unorm pack2x16snorm pack2x16unorm pack2x16float unpack4x8snorm unpack4x8unorm
    unpack2x16snorm unpack2x16unorm unpack2x16float i64 u64 push_constant r64uint";

/// Functions and variables of the passes around a kernel, except helpers, which say their own names. A test compares them
/// with the passes.
const OURS: &str = "
    element_pass nodes rest constants displacement velocity increment slots slot incidence margins energies stresses gate
    work_group_size elements_per_invocation constants_stride main element group groups local
    shape_gradients slopes inverse_jacobian nodal_displacement nodal_increment nodal_velocity
    gradient contract node_gradients energy force dforce diagonal cauchy damping ddamping damping_diagonal near far";

/// Whether a value may have this name.
pub fn is_free(name: &str) -> bool {
    // Helpers end in an underscore, structures of results and the two forms of kernels in those words; two underscores at
    // the beginning are reserved.
    let ours = ["_", "_result", "_near", "_far"].iter().any(|end| name.ends_with(end));
    let of_form = !ours && !name.starts_with("__");
    let taken = LANGUAGE.split_whitespace().chain(OURS.split_whitespace()).any(|word| word == name);
    of_form && !taken
}
