// SPDX-License-Identifier: Apache-2.0
// The colours of the picture. Those of the page are in view.css; the accent is the same in both.

const rgb = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);

const kThemes = {
  dark: {
    isDark: true,
    background: rgb('#12161c'),
    grid: rgb('#46515f'),
    frustum: rgb('#8896a8'),
    plain: rgb('#c9c2b4'),
    accent: rgb('#35c3f3'),
    force: rgb('#ff9f2e'),
    forbidden: rgb('#ff6b6b'),
    guidance: rgb('#5fd38a'),
    tissue: rgb('#c79bff'),
    preview: rgb('#e8ecf1'),
    trail: rgb('#35c3f3'),
    ink: rgb('#e8ecf1'),
    axes: [rgb('#e5707a'), rgb('#7cc36b'), rgb('#6f9df0')],
  },
  light: {
    isDark: false,
    background: rgb('#f1f3f6'),
    grid: rgb('#b6bfca'),
    frustum: rgb('#66717e'),
    plain: rgb('#b9b2a6'),
    accent: rgb('#0079ad'),
    force: rgb('#b84a00'),
    forbidden: rgb('#b3261e'),
    guidance: rgb('#1d7a45'),
    tissue: rgb('#6b3fb0'),
    preview: rgb('#1b2129'),
    trail: rgb('#0079ad'),
    ink: rgb('#1b2129'),
    axes: [rgb('#b93a46'), rgb('#3d7d2e'), rgb('#2f62c4')],
  },
};

const kKey = 'hapticd-view-theme';

/** Where the browser keeps nothing for this page (private windows) the choice lasts as long as the page. */
function stored() {
  try {
    return localStorage.getItem(kKey);
  } catch {
    return null;
  }
}

export class Theme {
  /** `onChange(colours)` is called at once and after each change. */
  constructor(onChange) {
    this.system = matchMedia('(prefers-color-scheme: dark)');
    this.chosen = stored();
    this.onChange = onChange;
    this.system.addEventListener('change', () => this.apply());
    this.apply();
  }

  get name() {
    if (this.chosen in kThemes) return this.chosen;
    return this.system.matches ? 'dark' : 'light';
  }

  toggle() {
    this.chosen = this.name === 'dark' ? 'light' : 'dark';
    try {
      localStorage.setItem(kKey, this.chosen);
    } catch {
      // kept for this page only
    }
    this.apply();
  }

  apply() {
    document.documentElement.dataset.theme = this.name;
    this.onChange(kThemes[this.name]);
  }
}
