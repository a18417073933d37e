!> What a beam is besides its material: what holds its root, its section, masses on it.
module body_settings
   use kinds, only: wp
   use run_settings, only: name_length
   implicit none (type, external)
   private
   public :: root_settings_t, mass_settings_t
   public :: root_clamped, root_pinned, root_names

   !> The root is held, by springs where they are given.
   integer, parameter :: root_clamped = 1
   !> The root turns freely.
   integer, parameter :: root_pinned = 2
   character(*), parameter :: root_names(2) = [character(name_length) :: 'clamped', 'pinned']

   !> &root
   type :: root_settings_t
      !> One of the `root_` constants
      integer :: kind = root_clamped
      !> k / (3 E Ibar / L) of a spring against rotation, k / (3 E Ibar / L^3) of one against displacement; 0: there is
      !> none, it is held
      real(wp) :: rotation_stiffness_ratio = 0.0_wp
      real(wp) :: translation_stiffness_ratio = 0.0_wp
   end type root_settings_t

   !> &mass
   type :: mass_settings_t
      !> x / L
      real(wp) :: position = 1.0_wp
      !> m / (rho Abar L), and J / (rho Abar L^3)
      real(wp) :: mass_ratio = 0.0_wp
      real(wp) :: rotary_inertia_ratio = 0.0_wp
   end type mass_settings_t

end module body_settings
