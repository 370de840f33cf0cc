"""The part of the written file that is the same for every model: the class that Mitsuba calls.

It uses what stands above it: NAME, BY, LABELS, VALUES, COSINE, DRAWN, ANISOTROPIC, PRECISE, and the functions _prepare,
_incidence and _reflected, which take arrays of Dr.Jit alone.
"""

MARK = "# ---- What follows needs Mitsuba. ----"

SURFACE = '''
import mitsuba as mi

if mi.variant() is None:
    raise ImportError("choose a variant before this file is imported: mitsuba.set_variant('llvm_ad_rgb')")

JIT = dr.is_jit_v(mi.Float)
# Scalar variants have numbers of Python, which raise errors where arrays give infinity: arrays of length 1 instead.
Float = (dr.float64_array_t(mi.Float) if PRECISE else mi.Float) if JIT else dr.scalar.ArrayXf64
BELOW_ONE = 1 - 2**-24
LONGEST = 16  # rounds of a sum that are written out, as a loop takes long to start


def _sum(body, count):
    """A sum of what a function gives for each index, as a loop of the compiled program where it is long."""
    if not JIT or count <= LONGEST:
        return sum((body(k) for k in range(1, count)), body(0))
    start = (dr.uint32_array_t(Float)(0), Float(0))
    added = lambda k, total: (k + 1, total + body(k))
    return dr.while_loop(start, lambda k, total: k < count, added, max_iterations=-1)[1]


def _components(vector):
    return Float(vector.x), Float(vector.y), Float(vector.z)


def _of_mitsuba(value):
    """An array as Mitsuba's variant has it: scalar variants take numbers."""
    return mi.Float(value) if JIT else float(value[0])


class Surface(mi.BSDF):
    """The BSDF: f times the cosine of wo, for light from above onto the side that the normal is on.

    Properties: NAME of any value in VALUES, a number for it; BY ('channel' or 'wavelength'), one of the LABELS.
    """

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.kind, chosen = _kind(props)
        self.values = {}
        for name, numbers in VALUES.items():
            numbers = [numbers[k] for k in chosen]
            if props.has_property(name):
                numbers = [float(props[name])] * len(numbers)
            self.values[name] = (mi.Color3f if self.kind == "rgb" else mi.Float if JIT else Float)(numbers)
        self.wavelengths = Float([float(label) for label in LABELS]) if self.kind == "spectral" else None
        flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
        if ANISOTROPIC:
            flags = flags | mi.BSDFFlags.Anisotropic
        self.m_components, self.m_flags = [flags], flags
        self.parameters_changed([])

    def traverse(self, callback):
        """Every value can be set and differentiated, in the variants that have derivatives."""
        if JIT:
            for name, value in self.values.items():
                callback.put(name, value, mi.ParamFlags.Differentiable)

    def parameters_changed(self, keys):
        """What depends on the values alone, computed once, and the means by which directions are drawn."""
        sets = self._sets()
        self.ready = [_prepare(values) for values in sets]
        self.mean = {}
        for name in VALUES:
            self.mean[name] = dr.detach(_mean([values[name] for values in sets]))
        if JIT:
            dr.make_opaque(self.values, self.ready, self.mean, self.wavelengths)

    def _sets(self):
        """The values of each channel; those of all wavelengths together."""
        if self.kind != "rgb":
            return [{name: Float(value) for name, value in self.values.items()}]
        return [{name: Float(value[k]) for name, value in self.values.items()} for k in range(3)]

    def _prepared(self):
        """The values of each set with what depends on them alone, anew where derivatives are asked for."""
        for values, ready in zip(self._sets(), self.ready):
            yield values, _prepare(values) if dr.grad_enabled(values) else ready

    def _brdf(self, si, w_i, w_r):
        """f [1/sr], unpolarised, in the channels or at the wavelengths of the variant."""
        found = []
        for values, ready in self._prepared():
            if self.kind == "spectral":
                found += [self._at(Float(nm), values, ready, w_i, w_r) for nm in si.wavelengths]
            else:
                found.append(_reflected(values, ready, _incidence(values, ready, w_i), w_i, w_r))
        found = [_of_mitsuba(Float(f)) for f in found]
        return mi.UnpolarizedSpectrum(found[0]) if len(found) == 1 else mi.UnpolarizedSpectrum(*found)

    def _at(self, nm, values, ready, w_i, w_r):
        """f between the two nearest wavelengths of the fit; beyond the first and the last one, as there."""
        Index = dr.uint32_array_t(Float)
        last = len(LABELS) - 1
        place = Index(0)
        for label in LABELS[1:-1]:
            place = dr.select(nm >= float(label), place + 1, place)
        found = []
        for k in (place, place + 1):
            of_set = {name: dr.gather(Float, value, k) for name, value in values.items()}
            prepared = [p if dr.width(p) != last + 1 else dr.gather(Float, p, k) for p in ready]
            found.append(_reflected(of_set, prepared, _incidence(of_set, prepared, w_i), w_i, w_r))
        lower, upper = (dr.gather(Float, self.wavelengths, k) for k in (place, place + 1))
        share = (nm - lower) / (upper - lower)
        share = dr.select(share < 0, 0.0, dr.select(share > 1, 1.0, share))
        return found[0] + share * (found[1] - found[0])

    def _value(self, ctx, si, wo, active):
        """f times the cosine of wo. Light travels from wo to wi, or from wi to wo where importance is traced."""
        above = (si.wi.z > 0) & (wo.z > 0) & active
        normal = mi.Vector3f(0, 0, 1)
        light, view = dr.select(above, wo, normal), dr.select(above, si.wi, normal)
        if ctx.mode == mi.TransportMode.Importance:
            light, view = view, light
        f = self._brdf(si, _components(light), _components(view))
        return dr.select(above, f * wo.z, 0)

    def _density(self, si, wo, active):
        """Probability density [1/sr] of the directions that `sample` gives."""
        above = (si.wi.z > 0) & (wo.z > 0) & active
        normal = mi.Vector3f(0, 0, 1)
        w_i, w_r = _components(dr.select(above, si.wi, normal)), _components(dr.select(above, wo, normal))
        found = COSINE * w_r[2] / math.pi
        for share, _, density in DRAWN:
            found = found + share * density(self.mean, w_i, w_r)
        return dr.select(above, _of_mitsuba(dr.detach(found)), 0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        """A direction by the cosine or by one of the lobes, with f times its cosine over its density."""
        above = (si.wi.z > 0) & active
        w_i = _components(dr.select(above, si.wi, mi.Vector3f(0, 0, 1)))
        u, v = (dr.select(Float(s) < BELOW_ONE, Float(s), BELOW_ONE) for s in (sample2.x, sample2.y))
        radius, choice = dr.sqrt(u), Float(sample1)
        drawn = (radius * dr.cos(2 * math.pi * v), radius * dr.sin(2 * math.pi * v), dr.sqrt(1 - u))
        least = COSINE
        for share, draw, _ in DRAWN:
            other = draw(self.mean, w_i, (u, v))
            drawn = tuple(dr.select(choice >= least, new, old) for new, old in zip(other, drawn))
            least += share
        wo = dr.normalize(mi.Vector3f(*(_of_mitsuba(dr.detach(Float(c))) for c in drawn)))
        above = above & (wo.z > 0) & ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0)
        wo = dr.select(above, wo, mi.Vector3f(0, 0, 1))
        density = self._density(si, wo, above)
        above = above & (density > 0)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo, bs.pdf, bs.eta = wo, density, 1.0
        bs.sampled_type, bs.sampled_component = mi.UInt32(+mi.BSDFFlags.GlossyReflection), mi.UInt32(0)
        value = self._value(ctx, si, wo, above) / dr.select(above, density, 1)
        return bs, mi.depolarizer(dr.select(above, value, 0))

    def eval(self, ctx, si, wo, active=True):
        """f times the cosine of wo."""
        return mi.depolarizer(self._value(ctx, si, wo, self._enabled(ctx, active)))

    def pdf(self, ctx, si, wo, active=True):
        """Probability density [1/sr] of `sample`."""
        return self._density(si, wo, self._enabled(ctx, active))

    def eval_pdf(self, ctx, si, wo, active=True):
        """Both."""
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def _enabled(self, ctx, active):
        return active & ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0)

    def to_string(self):
        """The values."""
        return f"{NAME}[{', '.join(f'{name} = {value}' for name, value in self.values.items())}]"


def _mean(values):
    """The mean over channels, or over wavelengths, which one array holds."""
    total = values[0]
    for value in values[1:]:
        total = total + value
    return Float(dr.mean(total)) / len(values)


def _kind(props):
    """What the variant asks for, one value, three channels or a spectrum, and the sets that it takes."""
    if BY and props.has_property(BY):
        label = props[BY]
        for k, known in enumerate(LABELS):
            if (float(label) == float(known)) if BY == "wavelength" else (str(label) == known):
                return "one", [k]
        raise RuntimeError(f"{NAME}: has no {BY} {label}; it has {', '.join(LABELS)}")
    if len(LABELS) == 1:
        return "one", [0]
    if BY == "channel" and mi.is_rgb and sorted(LABELS) == ["B", "G", "R"]:
        return "rgb", [LABELS.index(name) for name in "RGB"]
    if BY == "wavelength" and mi.is_spectral:
        return "spectral", list(range(len(LABELS)))
    needed = "a spectral variant" if BY == "wavelength" else "an rgb variant, if its channels are R, G and B"
    raise RuntimeError(f"{NAME}: was fitted for each {BY}: take {needed}, or the property {BY!r}: {', '.join(LABELS)}")


mi.register_bsdf(NAME, lambda props: Surface(props))
'''
