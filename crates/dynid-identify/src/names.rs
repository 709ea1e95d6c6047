//! Enumerations of names as they are printed.

/// An enumeration of names as they are printed.
#[doc(hidden)]
#[macro_export]
macro_rules! names {
    ($(#[$doc:meta])* $kind:ident { $($(#[$text:meta])* $variant:ident = $name:literal,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $kind {
            $($(#[$text])* $variant,)*
        }

        impl $kind {
            /// Every variant once.
            pub const ALL: &'static [$kind] = &[$($kind::$variant,)*];

            /// The variant of a printed name.
            pub fn of_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|known| known.name() == name)
            }

            /// Name as printed.
            pub const fn name(self) -> &'static str {
                match self {
                    $($kind::$variant => $name,)*
                }
            }
        }
    };
}
