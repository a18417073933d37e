!> The modes of a beam without contact, and quantities that follow from modes and matrices of the mesh. As
!> `find_free_modes` returns them, they do not depend on damping, the laws of the stops and the duration of a run, so
!> all runs of a beam on one mesh, in all threads, share them. A run that selects or reorders modes, or adds residual
!> modes or modes of extra degrees of freedom, does so in a copy.
module free_modes
   use beam_model, only: beam_model_t, beam_alone
   use constrained_modes, only: attach_supports
   use failures, only: failure_t
   use kinds, only: lambda1, wp
   use natural_solver, only: natural_modes
   use run_settings, only: extra_dof_t, name_length, run_settings_t
   use skyline_matrix, only: multiply
   use sorting, only: order_columns
   implicit none (type, external)
   private
   public :: free_modes_t, find_free_modes, complete_modes, are_modes_of_run, retain_modes, order_modes, complete_start
   public :: are_same, mover_of, rigid_square, max_rigid_square

   type :: free_modes_t
      !> Number of elements of the mesh
      integer :: elements = 0
      !> Degree of freedom of the displacement at the first stop
      integer :: stop_dof = 0
      !> Degree of freedom of the tip
      integer :: tip_dof = 0
      !> Degrees of freedom of the displacement and rotation of the root; 0: fixed
      integer :: root_dofs(2) = 0
      !> Wave numbers lambda_i, [modes], ascending as computed (`retain_modes` and `order_modes` change the
      !> order)
      real(wp), allocatable :: lambda(:)
      !> Squared frequencies W_i^2 = (lambda_i/lambda1)^4 in omega1^2, [modes]
      real(wp), allocatable :: square(:)
      !> Mass-normalised modes, rho Abar L = 1, [degrees of freedom, modes]
      real(wp), allocatable :: mode(:, :)
      !> Index of the extra degree of freedom of which each is the mode; 0: mode of the beam. Unallocated: there are no
      !> modes of extra degrees of freedom, [modes]
      integer, allocatable, private :: extra(:)
      !> Names of the extra degrees of freedom
      character(name_length), allocatable, private :: name(:)
      !> Damping rate of each mode, over omega1, instead of the damping of the beam; negative: the mode has none.
      !> Unallocated: no mode has such a rate, [modes]
      real(wp), allocatable :: own_rate(:)
      !> Damping rates besides 2 zeta W^2; unallocated: not known yet, or 0, [modes]
      real(wp), allocatable :: rate(:)
      !> Squared frequencies of the truncated modes, whose static part a run adds to the bending moments; unallocated:
      !> no mode is truncated, or the run needs no truncated modes (it has no stresses, or it has residual modes)
      real(wp), allocatable :: truncated_square(:)
      !> Shapes of the truncated modes
      real(wp), allocatable :: truncated_mode(:, :)
      !> Displacement of a massless node at the stop (of a redistributed mass matrix, docs/theory.md, section 14) under
      !> a force on it of one unit, rho Abar L omega1^2 D, if all other degrees of freedom are fixed; 0: the node has
      !> mass
      real(wp) :: node_flexibility = 0.0_wp
      !> Component of M phi_i at the degree of freedom of the stop, for impacts that replace the velocity of the node at
      !> the stop alone, [modes]
      real(wp), allocatable :: nodal_mass(:)
   end type free_modes_t

   !> W^2 of a rigid-body mode, positive because formulas divide by W^2. The motion of the mode differs from a
   !> polynomial in time, or with mass-proportional damping from an exponential, by (W t)^2/2, which is below rounding
   !> in a run of the maximum duration, t = 1e9.
   real(wp), parameter :: rigid_square = 1.0e-40_wp
   !> Modes up to this W^2 have no restoring force: rigid-body modes, masses without springs, and combinations of both.
   !> The limit is so far above the W^2 of these modes (`rigid_square`, and `append_modes`) that rounding errors
   !> of the combinations do not exceed it.
   real(wp), parameter :: max_rigid_square = 1.0e-30_wp

contains

   !> Compute all modes of a beam, followed by those of its extra degrees of freedom.
   subroutine find_free_modes(model, modes, error)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(out) :: modes
      !> Set if the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      type(beam_model_t) :: beam

      beam = beam_alone(model)
      call natural_modes(beam, beam%stiffness%order - merge(1, 0, beam%has_massless_node), modes%lambda, error, &
         modes%mode)
      if (allocated(error)) return
      call attach_supports(beam%supports, modes%lambda, modes%mode)
      call complete_modes(beam, modes)
      if (size(model%extra) > 0) call append_modes(model%extra, size(modes%lambda), modes)
   end subroutine find_free_modes

   !> Whether all of the first modes, and no others, are those of a run.
   pure logical function are_modes_of_run(settings, retained, modes) result(answer)
      type(run_settings_t), intent(in) :: settings
      !> Number of modes of the beam that are retained
      integer, intent(in) :: retained
      type(free_modes_t), intent(in) :: modes

      answer = retained == size(modes%lambda) .and. .not. allocated(settings%extra_dofs)
   end function are_modes_of_run

   !> Whether two sets of modes are equal, and so belong to one beam.
   pure logical function are_same(one, other) result(answer)
      type(free_modes_t), intent(in) :: one
      type(free_modes_t), intent(in) :: other

      answer = size(one%lambda) == size(other%lambda) .and. size(one%mode) == size(other%mode) .and. &
         one%stop_dof == other%stop_dof
      if (answer) answer = all(abs(one%lambda - other%lambda) <= 0.0_wp) .and. all(abs(one%mode - other%mode) <= 0.0_wp)
   end function are_same

   !> Retain the first modes of a beam, and append those of the extra degrees of freedom of a run, unless `modes`
   !> contains them already. Modes beyond `number` remain until `order_modes`.
   pure subroutine retain_modes(settings, retained, modes, number)
      type(run_settings_t), intent(in) :: settings
      !> Number of modes of the beam that are retained; all modes are retained if they contain those appended
      integer, intent(in) :: retained
      type(free_modes_t), intent(inout) :: modes
      !> Number of modes of the run
      integer, intent(out) :: number

      number = retained
      if (.not. allocated(settings%extra_dofs)) return
      if (.not. allocated(modes%extra)) call append_modes(settings%extra_dofs, retained, modes)
      number = size(modes%square)
   end subroutine retain_modes

   !> Put modes into another order; modes that the order does not contain are removed.
   pure subroutine order_modes(order, modes)
      !> Indices of the modes
      integer, intent(in) :: order(:)
      type(free_modes_t), intent(inout) :: modes

      if (allocated(modes%extra)) modes%extra = modes%extra(order)
      if (allocated(modes%own_rate)) modes%own_rate = modes%own_rate(order)
      modes%rate = modes%rate(order)
      modes%lambda = modes%lambda(order)
      modes%square = modes%square(order)
      call order_columns(modes%mode, order)
   end subroutine order_modes

   !> Retain the first modes of the beam, and append one mode for each extra degree of freedom. Modes are
   !> mass-normalised: z is 1/sqrt(m) per unit of its mode, with m the mass.
   pure subroutine append_modes(extra, retained, modes)
      type(extra_dof_t), intent(in) :: extra(:)
      !> Number of modes of the beam that are retained
      integer, intent(in) :: retained
      type(free_modes_t), intent(inout) :: modes

      real(wp), allocatable :: shape(:, :), square(:)
      integer :: k

      associate (dofs => size(modes%mode, 1), number => size(extra))
         allocate (shape(dofs + number, retained + number), square(retained + number), source=0.0_wp)
         shape(:dofs, :retained) = modes%mode(:, :retained)
         square(:retained) = modes%square(:retained)
         do k = 1, number
            shape(dofs + k, retained + k) = 1.0_wp/sqrt(extra(k)%mass)
            ! A free mass gets a negligible positive W^2, because formulas divide by W^2; the factor k + 1 separates it
            ! from a rigid-body mode of the beam (factor 1) and from the other free masses
            square(retained + k) = max(extra(k)%square, real(k + 1, wp)*rigid_square)
            ! `constrain` needs distinct frequencies
            do while (any(abs(square(:retained + k - 1) - square(retained + k)) <= 0.0_wp))
               square(retained + k) = nearest(square(retained + k), 1.0_wp)
            end do
         end do
         modes%lambda = lambda1*sqrt(sqrt(square))
         modes%extra = [spread(0, 1, retained), [(k, k=1, number)]]
         if (any(extra%rate >= 0.0_wp)) modes%own_rate = [spread(-1.0_wp, 1, retained), extra%rate]
      end associate
      call move_alloc(shape, modes%mode)
      call move_alloc(square, modes%square)
      modes%name = extra%name
   end subroutine append_modes

   !> What moves freely in a mode without strain, for messages.
   pure function mover_of(modes, i) result(mover)
      type(free_modes_t), intent(in) :: modes
      !> Index of the mode
      integer, intent(in) :: i
      character(:), allocatable :: mover

      mover = 'the beam, which turns freely about its root'
      if (.not. allocated(modes%extra)) return
      if (modes%extra(i) > 0) mover = trim(modes%name(modes%extra(i)))//', which moves freely'
   end function mover_of

   !> Complete the start of a beam to that of a run: set the extra degrees of freedom. If the run starts in equilibrium,
   !> only their velocities are set.
   pure subroutine complete_start(model, is_in_equilibrium, displacement, velocity, modes)
      !> The model of the run
      type(beam_model_t), intent(in) :: model
      logical, intent(in) :: is_in_equilibrium
      !> Displacements, [degrees of freedom, or modes]
      real(wp), intent(inout) :: displacement(:)
      !> Velocities, [degrees of freedom, or modes]
      real(wp), intent(inout) :: velocity(:)
      !> Modes that are the coordinates; absent: the coordinates are the degrees of freedom
      type(free_modes_t), intent(in), optional :: modes

      ! displacement of the beam at the contact with the extra degree of freedom; z per unit of its coordinate
      real(wp) :: beam, unit
      integer :: dof, k, near, place

      do k = 1, size(model%extra)
         dof = model%mass%order - size(model%extra) + k
         near = model%stop_dofs(findloc(model%partner_dofs, dof, dim=1))
         if (present(modes)) then
            beam = dot_product(modes%mode(near, :), displacement)
            place = findloc(modes%extra, k, dim=1)
            unit = modes%mode(dof, place)
         else
            beam = displacement(near)
            place = dof
            unit = 1.0_wp
         end if
         associate (extra => model%extra(k))
            velocity(place) = extra%start_velocity/unit
            if (.not. is_in_equilibrium) displacement(place) = (extra%start_displacement &
               + merge(beam, 0.0_wp, extra%starts_from_beam))/unit
         end associate
      end do
   end subroutine complete_start

   !> Compute the quantities that follow from lambda and the mode shapes.
   subroutine complete_modes(model, modes)
      type(beam_model_t), intent(in) :: model
      !> On entry with lambda and the mode shapes; on return complete
      type(free_modes_t), intent(inout) :: modes

      real(wp), allocatable :: unit(:), mass_column(:)

      modes%elements = model%mesh%elements
      modes%stop_dof = model%stop_dof
      modes%tip_dof = model%tip_dof
      modes%root_dofs = model%root_dofs
      allocate (modes%square, source=max((modes%lambda/lambda1)**4, rigid_square))
      allocate (unit(model%mass%order), mass_column(model%mass%order))
      if (model%has_massless_node) then
         modes%node_flexibility = lambda1**4/model%stiffness%values(model%stiffness%diagonal(model%stop_dof))
      end if
      unit = 0.0_wp
      unit(model%stop_dof) = 1.0_wp
      call multiply(model%mass, unit, mass_column)
      allocate (modes%nodal_mass, source=matmul(mass_column, modes%mode))
   end subroutine complete_modes

end module free_modes
