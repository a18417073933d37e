!> Choice between the consistent mass matrix and the one redistributed at the stop, by the error of a run
!> (docs/theory.md, section 14).
module mass_choice
   use beam_mesh, only: mesh_t
   use beam_section, only: area, section_t
   use kinds, only: wp
   use run_settings, only: impulse_nodal, method_exact, run_settings_t, stop_settings_t
   use stop_laws, only: is_rigid
   use stop_contacts, only: has_one_contact, stops_of
   implicit none (type, external)
   private
   public :: is_redistribution_more_accurate

contains

   !> Is the mass matrix redistributed at the stop more accurate than the consistent one?
   !>
   !> The consistent matrix adds a part of the last element to the mass that is hit, an error of first order in the
   !> length of the element. With the redistributed matrix frequencies lose a digit, and a point mass lighter than an
   !> element chatters at the scale of the mesh. The momentum that a point mass keeps, eps mu, decides which error is
   !> larger: if it is at least `share` of the mass of the last element, the redistributed matrix is better (uniform
   !> beams of 3 to 32 elements, mu from 0.02 to 6, eps from 0.03 to 0.9, zeta 0.001, 0.02 and 0.1: right in 91 of 100
   !> cases; in the others the better matrix has a third of the error on average). Replacing the nodal velocity with the
   !> consistent matrix changes the energy in the elements at the stop. Among several contacts those at the tip count,
   !> provided that all of them are rigid: the one with the highest restitution.
   pure function is_redistribution_more_accurate(section, mesh, tip_mass_ratio, settings) result(answer)
      type(section_t), intent(in) :: section
      type(mesh_t), intent(in) :: mesh
      !> Tip mass over the mass of the beam, mu
      real(wp), intent(in) :: tip_mass_ratio
      type(run_settings_t), intent(in) :: settings
      logical :: answer

      real(wp), parameter :: share = 0.6_wp
      type(stop_settings_t), allocatable :: stops(:)
      integer, allocatable :: nodes(:)

      ! only exact motion can integrate a node without mass, in closed form
      answer = has_one_contact(settings, 0) .and. is_rigid(settings%stop) .and. &
         settings%stop%impulse == impulse_nodal .and. settings%response%method == method_exact
      if (answer .or. tip_mass_ratio <= 0.0_wp) return
      stops = stops_of(settings)
      nodes = [mesh%stop_node]
      if (size(stops) > 1) nodes = [nodes, mesh%more_nodes(:size(stops) - 1)]
      stops = pack(stops, nodes(:size(stops)) == mesh%elements)
      if (size(stops) == 0 .or. .not. all(is_rigid(stops))) return
      associate (stop => stops(maxloc(stops%restitution, dim=1)), length => mesh%length(mesh%elements))
         answer = stop%impulse == impulse_nodal .or. &
            stop%restitution*tip_mass_ratio >= share*length*area(section, 0.5_wp*length)
      end associate
   end function is_redistribution_more_accurate

end module mass_choice
