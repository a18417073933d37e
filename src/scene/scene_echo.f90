!> The resolved scene as a list of names and values, for files and tables.
module scene_echo
   use kinds, only: wp
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: echo_t, echo_scene

   !> One name and its resolved value: a number, a list of numbers, or a text.
   type :: echo_t
      !> Group and name as users write them, such as 'stop' and 'preload'
      character(:), allocatable :: group
      character(:), allocatable :: name
      !> What it is, with its unit
      character(:), allocatable :: meaning
      !> Value in words, always there
      character(:), allocatable :: text
      !> Value, one element or a list; unallocated: the value is no number
      real(wp), allocatable :: number(:)
      !> The value is a list, even if of one element
      logical :: is_list = .false.
   end type echo_t

contains

   !> The names and values of a scene that count in it: ratios instead of physical units, defaults
   !> filled in, without the groups that it does not ask for.
   subroutine echo_scene(scene, entries)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Names and values, group by group; the last group is `scales`
      type(echo_t), allocatable, intent(out) :: entries(:)

      allocate (entries(5))
      entries(1) = number('mesh', 'elements', 'number of elements', real(scene%mesh%elements, wp))
      entries(2) = number('mesh', 'ratio', 'ratio of neighbouring lengths l_i / l_(i+1)', scene%mesh%ratio)
      entries(3) = number('damping', 'zeta', 'damping ratio gamma omega1 / 2', scene%zeta)
      entries(4) = number('tip_mass', 'ratio', 'tip mass in rho Abar L', scene%tip_mass_ratio)
      entries(5) = number('scales', 'omega1', 'reference frequency, rad per unit of time', scene%scales%omega1)
   end subroutine echo_scene

   !> An entry with one number.
   function number(group, name, meaning, value) result(entry)
      !> Group, name, meaning of the entry
      character(*), intent(in) :: group
      character(*), intent(in) :: name
      character(*), intent(in) :: meaning
      !> Its value
      real(wp), intent(in) :: value
      type(echo_t) :: entry

      character(32) :: buffer

      write (buffer, '(g0)') value
      entry%group = group
      entry%name = name
      entry%meaning = meaning
      entry%text = trim(buffer)
      allocate (entry%number(1), source=value)
   end function number

end module scene_echo
